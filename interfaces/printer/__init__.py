"""What crosses rooms in the printer task: its sections of a cell file."""
