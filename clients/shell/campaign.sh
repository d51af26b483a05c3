#!/usr/bin/env bash
# A campaign over weftd's socket with nc: campaign.sh RECIPE     (WEFT_SOCKET names the socket)
set -euo pipefail
recipe=${1:?campaign.sh RECIPE}
coproc daemon { nc -U "${WEFT_SOCKET:?names the socket of weftd}"; }
exec {from}<&"${daemon[0]}" {to}>&"${daemon[1]}"

# field NAME: the text or number of that name in the line on standard input; the last where there are several
field() { sed -n 's/.*"'"$1"'":"\{0,1\}\([^",}]*\).*/\1/p'; }

# ask NUMBER METHOD PARAMS: sends a request and prints the answer; events that come before it go to standard error
ask() {
  printf '{"jsonrpc":"2.0","id":%d,"method":"%s","params":%s}\n' "$1" "$2" "$3" >&"$to"
  local line
  while read -r line <&"$from"; do
    case $line in  # weftd writes the number first, then what it has to say
      *'"method":"event"'*) [ -z "$(field state <<<"$line")" ] || echo "  now $(field state <<<"$line")" >&2 ;;
      '{"jsonrpc":"2.0","id":'"$1"',"error":'*) echo "$2 was refused: $line" >&2; return 1 ;;
      '{"jsonrpc":"2.0","id":'"$1"',"result":'*) echo "$line"; return 0 ;;
    esac
  done
  echo "the daemon closed the connection" >&2
  return 1
}

ask 1 session.open '{"client":"campaign.sh","protocol":"1.x"}' >/dev/null
checked=$(ask 2 recipe.check "{\"recipe\":\"$recipe\"}")
[ "$(field ok <<<"$checked")" = true ] || { echo "the rig cannot run it: $checked" >&2; exit 1; }
lease=$(ask 3 lease.acquire '{"ttl_ms":60000,"note":"campaign.sh"}' | field lease)
run=$(ask 4 run.start "{\"recipe\":\"$recipe\",\"lease\":\"$lease\"}" | field run)
echo "$run has begun"
ask 5 sub.open "{\"topics\":[\"run:$run\"],\"mode\":\"latest\",\"max_hz\":2}" >/dev/null
ended=$(ask 6 run.wait "{\"run\":\"$run\"}")
ask 7 lease.release "{\"lease\":\"$lease\"}" >/dev/null
echo "$run: outcome $(field outcome <<<"$ended"), cleanup $(field cleanup <<<"$ended"), rig $(field rig <<<"$ended")"
[ "$(field outcome <<<"$ended")" = complete ]
