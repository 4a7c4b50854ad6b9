"""The application: command line, scenario files, the episode loop, results and studies."""
