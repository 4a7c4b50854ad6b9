"""The ground floor: small value types that cross rooms, and the device protocols."""
