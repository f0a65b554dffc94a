"""People of any sex, age, build and origin: MakeHuman's body data, distilled into one file of the package."""
