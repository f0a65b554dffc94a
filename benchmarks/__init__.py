"""Each benchmark beside a named peer in the same run; see `vistel bench`."""
