"""What people ask of the world, and how it is done or refused.

`actions` says what may be asked, `reference` which things are meant, `reshape` what a thing becomes, `perform` does it,
`history` takes it back, `ledger` remembers what was answered.
"""
