#!/bin/sh
# Makes a conference's certificates: an authority, the hub's and one per site.
#   deploy/zenoh/certificates.sh FOLDER HUB-HOST SITE...
# The common name of a certificate is the site's name (or "hub"): the router's access rules go by it.
# Give each site ca.pem and its own .pem and .key; keep ca.key where no router runs.
set -eu
if [ $# -lt 3 ]; then
    echo "usage: $0 FOLDER HUB-HOST SITE..." >&2
    exit 2
fi
folder=$1
host=$2
shift 2
umask 077
mkdir -p "$folder"
cd "$folder"

key() {
    openssl genpkey -algorithm EC -pkeyopt ec_paramgen_curve:P-256 -out "$1.key" 2>/dev/null
}

if [ ! -f ca.key ]; then
    key ca
    openssl req -x509 -new -key ca.key -sha256 -days 3650 -subj "/CN=vistel authority" -out ca.pem
fi
for name in hub "$@"; do
    key "$name"
    extensions=$(mktemp)
    if [ "$name" = hub ]; then
        printf 'subjectAltName=DNS:%s,DNS:localhost,IP:127.0.0.1\n' "$host" >"$extensions"
    else
        printf 'subjectAltName=DNS:%s\n' "$name" >"$extensions"
    fi
    openssl req -new -key "$name.key" -subj "/CN=$name" |
        openssl x509 -req -CA ca.pem -CAkey ca.key -CAcreateserial -sha256 -days 825 -extfile "$extensions" \
            -out "$name.pem" 2>/dev/null
    rm "$extensions"
done
echo "certificates of hub and $* are in $folder"
