"""The same tape over other numbers.

======================  ==========================================================================
`double_double`         complex numbers of about 32 digits, over lanes of numpy arrays
`discs`                 complex discs in double precision with proved radii, over lanes
`balls`                 Arb balls of any precision, one point at a time
`multiprecision`        mpmath numbers of any precision, one point at a time
`values`                exact values of numbers and of parameters
======================  ==========================================================================
"""
