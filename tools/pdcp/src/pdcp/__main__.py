"""python -m pdcp."""

from .cli import main

main()
