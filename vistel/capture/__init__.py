"""From device frames to postures: receivers, gloves, faces and props of one site, filtered and solved."""
