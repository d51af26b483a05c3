#!/usr/bin/env bash
# Follows docs/tutorial.md word by word in a minimal Debian 12, as root: tests/minimal/tutorial.sh [FOLDER]
#
# Makes the new root with debootstrap in FOLDER (default: a new folder in /tmp) and clones HEAD into it. Types the commands of the page and compares
# their output with the page. Not part of script/test: it needs root, a Debian mirror, some 3 GB and the time of a full build. The evaluation page in
# the new root must show the figures of the tutorial's picture.
set -euo pipefail
source_tree=$(cd "$(dirname "$0")/../.." && pwd)
root=${1:-$(mktemp -d /tmp/weft-tutorial.XXXXXX)}
[ "$(id -u)" -eq 0 ] || { echo "tutorial.sh: needs root (debootstrap, chroot)" >&2; exit 1; }
command -v debootstrap >/dev/null || { echo "tutorial.sh: debootstrap is not installed" >&2; exit 77; }

debootstrap --variant=minbase --include=ca-certificates,git bookworm "$root" "${DEBIAN_MIRROR:-http://deb.debian.org/debian}" > "$root.log" 2>&1 ||
  { tail -5 "$root.log" >&2; exit 1; }
# this machine may reach its mirror in its own way
cp -r /etc/apt/apt.conf.d/. "$root/etc/apt/apt.conf.d/"
cp /etc/resolv.conf "$root/etc/resolv.conf"
cp /etc/ssl/certs/ca-certificates.crt "$root/etc/ssl/certs/"
git clone -q --bare "$source_tree" "$root/root/weft.git"

unshare --mount --pid --fork --kill-child bash -euo pipefail -s "$root" <<'INSIDE'
root=$1
mount -t proc proc "$root/proc"
mount --rbind /dev "$root/dev"
mount -t tmpfs tmpfs "$root/tmp"
chroot "$root" /usr/bin/env -i HOME=/root TERM=dumb PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin bash -euo pipefail -c '
  cd /root
  git clone -q weft.git weft
  cd weft
  git log --oneline -1
  # step 1 of the page, which the test of the page cannot run: typed here as written there
  sed -n "/^<!-- not run/,/^\`\`\`\$/p" docs/tutorial.md | sed -n "/^\`\`\`sh\$/,/^\`\`\`\$/p" | sed "/^\`\`\`/d" > /root/step1
  cat /root/step1
  bash -euo pipefail /root/step1 > /root/step1.log 2>&1 || { tail -20 /root/step1.log; exit 1; }
  # the rest, in the clone itself
  python3 tests/scenario/docs_commands.py build/release . --here docs/tutorial.md
  grep -q "SIMULATED" out/lesson/evaluation.html
  grep -q "100.00" out/lesson/evaluation.html && grep -q "84.54" out/lesson/evaluation.html && echo "the page has the figures of the picture"
'
INSIDE
echo "tutorial.sh: $root can be removed"
