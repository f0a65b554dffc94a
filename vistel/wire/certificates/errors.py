"""What is wrong with a certificate; it loads no cryptography, so that who only might see one need not either."""


class CertificateError(ValueError):
    """A certificate or key that is missing, broken or not good now; the text says which, and what to do."""
