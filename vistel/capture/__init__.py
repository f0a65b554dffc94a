"""From frames of devices to postures: receivers, gloves, faces and props of one site, filtered and solved."""
