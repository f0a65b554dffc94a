"""How commands of the world (`vistel.space.actions`) are done or refused.

`reference` finds the things that are meant, `reshape` makes what a thing becomes, `perform` does a command.
"""
