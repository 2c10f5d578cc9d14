"""Vehicle files for people: a commented file written from answers, and a file checked in words."""
