#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Man pages and completion name every command and every option that the help of darb lists.
#   pages.sh BUILD
set -euo pipefail
darb=$1/darb
root=$(cd "$(dirname "$0")/../.." && pwd)
pages=$(mktemp -d)
trap 'rm -rf "$pages"' EXIT
python3 -B "$root/tools/command_pages.py" "$darb" "$pages"
bash -n "$pages/bash/darb"

failed=0 options=0
# names NAME FILE TEXT: whether a page or a completion names an option or a command.
names() {
    grep -qE -- "(^|[^-a-z0-9])$1([^-a-z0-9]|\$)" <<<"$3" || { echo "$2 does not name $1"; failed=1; }
}
bash=$(<"$pages/bash/darb") zsh=$(<"$pages/zsh/_darb") fish=$(<"$pages/fish/darb.fish")
mapfile -t commands < <(COLUMNS=100 "$darb" --help | sed -nE '/^[A-Z][a-z]+:$/,$ s/^  ([a-z0-9]+) +.*/\1/p')
[[ ${#commands[@]} -gt 10 ]] || { echo "commands: ${commands[*]}"; failed=1; }
overview=$(gzip -dc "$pages/man1/darb.1.gz" | sed 's/\\-/-/g')
for command in "${commands[@]}"; do
    page=$(gzip -dc "$pages/man1/darb-$command.1.gz" | sed 's/\\-/-/g; s/\\f[BIR]/ /g')
    for text in "man:$overview" "bash:$bash" "zsh:$zsh" "fish:$fish"; do names "$command" "${text%%:*}" "${text#*:}"; done
    of_bash=$(sed -n "/^    $command)\$/,/esac ;;/p" <<<"$bash")
    of_zsh=$(sed -n "/^        $command)\$/,/;;\$/p" <<<"$zsh")
    of_fish=$(grep "__fish_seen_subcommand_from $command'" <<<"$fish" | sed -E 's/ -l ([a-z0-9-]+)/ --\1/g; s/ -s ([a-zA-Z])/ -\1/g')
    for option in $("$darb" "$command" --help-all | sed -nE 's/^  ((-[A-Za-z]|--[a-z0-9-]+)(, --?[A-Za-z0-9-]+)*).*/\1/p' | tr -d ,); do
        options=$((options + 1))
        names "$option" "darb-$command.1" "$page"
        names "$option" "bash: $command" "$of_bash"
        names "$option" "zsh: $command" "$of_zsh"
        names "$option" "fish: $command" "$of_fish"
    done
done
echo "${#commands[@]} commands, $options options"
[[ $options -gt 200 ]] || { echo "too few were found"; failed=1; }

# What bash offers for the start of a word.
offered() {
    bash -c "source '$pages/bash/darb'; COMP_WORDS=($*); COMP_CWORD=$(($# - 1)); _darb 2>/dev/null; echo \${COMPREPLY[*]}"
}
[[ $(offered darb tra) == train ]] || { echo "darb tra: $(offered darb tra)"; failed=1; }
[[ $(offered darb train --iter) == --iterations ]] || { echo "--iter: $(offered darb train --iter)"; failed=1; }
[[ $(offered darb train --preset go) == good ]] || { echo "--preset go: $(offered darb train --preset go)"; failed=1; }
exit "$failed"
