"""Seeds of runs, scenes and studies."""

MAX_SEED = 2**31 - 1  # whole numbers from 0 to this
