"""python -m oncenter."""

from oncenter.cli import main

main()
