"""Where the console is: the section `[console]` of a conference file."""

from pydantic import Field, field_validator, model_validator

from vistel.conference.devices import Checked
from vistel.conference.page_address import TOKEN, StreamTls, checked_page, page_is_local, page_url


class ConsoleConfig(Checked):
    """A page on which browsers see the room and how the conference goes."""

    at: str = ""
    """"HOST:PORT", or a port of this machine only; "": nowhere, but `vistel up` takes a free port of this machine."""
    token: str = Field(default="", pattern=TOKEN)
    """What viewers show to see it; needed where other machines reach it: 16 to 64 letters, digits, _ and -."""
    host_token: str = Field(default="", pattern=TOKEN)
    """What the host shows to see it and to steer; without any token, everybody on its machine may."""
    tls: StreamTls | None = None
    """Its certificate; without one, it makes its own where other machines reach it."""
    insecure: bool = False
    """Plain HTTP beyond this machine is meant: everybody on the way reads the token and sees the room."""

    @property
    def page(self) -> str:
        """What a browser of its machine opens; empty for none."""
        return page_url(self.at, https=self.tls is not None or not (self.insecure or page_is_local(self.at)))

    @field_validator("at")
    @classmethod
    def _is_address(cls, at: str) -> str:
        return checked_page(at)

    @model_validator(mode="after")
    def _can_be(self) -> "ConsoleConfig":
        if not self.token and not page_is_local(self.at):
            raise ValueError("at: other machines reach it: expected a token that nobody guesses, of 16 letters or more")
        if self.host_token and self.host_token == self.token:
            raise ValueError("host_token: is the token of all viewers, who would steer; expected another one")
        if self.host_token and not self.token:
            raise ValueError("host_token: is for a console whose viewers show a token; give it a token as well")
        if self.tls is not None and self.insecure:
            raise ValueError("insecure: is for plain HTTP, and tls names a certificate; leave one of them out")
        return self


def certificate_name(conference: str) -> str:
    """The name under which the certificate that the console has made for itself is kept."""
    return f"{conference}-console"
