"""Reports: a run or a campaign as one HTML page that needs nothing else."""
