"""The connector over time: track, slip, stillness."""
