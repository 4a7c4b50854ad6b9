"""The tasks that come with the program: each in a folder, which nothing outside of it imports."""
