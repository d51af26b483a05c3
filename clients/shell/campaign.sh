#!/usr/bin/env bash
# Runs a campaign over weftd's socket with nc: campaign.sh RECIPE     (WEFT_SOCKET: path of the socket; WEFT_LEASE_MS: duration of the lease [ms])
set -euo pipefail
recipe=${1:?recipe missing (expected campaign.sh RECIPE)}
lease_ms=${WEFT_LEASE_MS:-60000}
lease='' renew_at_ms=0
printf -v third_s '%d.%03d' $((lease_ms / 3000)) $((lease_ms / 3 % 1000))
coproc daemon { nc -U "${WEFT_SOCKET:?not set (expected the socket of weftd)}"; }
exec {from}<&"${daemon[0]}" {to}>&"${daemon[1]}"

# field NAME: prints the last string or number with this name in the line on standard input
field() { sed -n 's/.*"'"$1"'":"\{0,1\}\([^",}]*\).*/\1/p'; }

# `tell NUMBER METHOD PARAMS`: sends a request
tell() { printf '{"jsonrpc":"2.0","id":%d,"method":"%s","params":%s}\n' "$1" "$2" "$3" >&"$to"; }

# keep_lease: renews the lease after a third of its time, as request 0
keep_lease() {
  local now_ms=$((${EPOCHREALTIME/[.,]/} / 1000))
  if [ -n "$lease" ] && ((now_ms >= renew_at_ms)); then
    renew_at_ms=$((now_ms + lease_ms / 3))
    tell 0 lease.renew "{\"lease\":\"$lease\",\"ttl_ms\":$lease_ms}"
  fi
}

# ask NUMBER METHOD PARAMS: sends a request and prints the answer; earlier events go to standard error
ask() {
  tell "$@"
  local line begun='' status
  while true; do
    keep_lease
    status=0
    read -r -t "$third_s" line <&"$from" || status=$?
    line=$begun$line begun=''
    if ((status > 128)); then begun=$line && continue; fi  # timeout, possibly with a part of a line
    if ((status > 0)); then echo "connection closed by the daemon" >&2 && return 1; fi
    case $line in  # weftd writes the number of the request first
      *'"method":"event"'*) [ -z "$(field state <<<"$line")" ] || echo "  now $(field state <<<"$line")" >&2 ;;
      '{"jsonrpc":"2.0","id":0,"error":'*) lease='' && echo "lease lost, the run continues: $line" >&2 ;;
      '{"jsonrpc":"2.0","id":'"$1"',"error":'*) echo "$2 was refused: $line" >&2; return 1 ;;
      '{"jsonrpc":"2.0","id":'"$1"',"result":'*) echo "$line"; return 0 ;;
    esac
  done
}

ask 1 session.open '{"client":"campaign.sh","protocol":"1.x"}' >/dev/null
checked=$(ask 2 recipe.check "{\"recipe\":\"$recipe\"}")
[ "$(field ok <<<"$checked")" = true ] || { echo "recipe $recipe cannot run on this rig: $checked" >&2; exit 1; }
lease=$(ask 3 lease.acquire "{\"ttl_ms\":$lease_ms,\"note\":\"campaign.sh\"}" | field lease)
# Also after a refused campaign and an interrupted script, so that other users need not wait until the lease expires.
trap 'trap "" PIPE; tell 8 lease.release "{\"lease\":\"$lease\"}" 2>/dev/null || true' EXIT
run=$(ask 4 run.start "{\"recipe\":\"$recipe\",\"lease\":\"$lease\"}" | field run)
echo "$run: state $(field state <<<"$(ask 9 run.get "{\"run\":\"$run\"}")")"
ask 5 sub.open "{\"topics\":[\"run:$run\"],\"mode\":\"latest\",\"max_hz\":2}" >/dev/null
ended=$(ask 6 run.wait "{\"run\":\"$run\"}")
ask 7 lease.release "{\"lease\":\"$lease\"}" >/dev/null || true  # fails if the lease was lost
echo "$run: outcome $(field outcome <<<"$ended"), cleanup $(field cleanup <<<"$ended"), rig $(field rig <<<"$ended")"
[ "$(field outcome <<<"$ended")" = complete ]
