# SPDX-License-Identifier: MIT
# To be sourced. Debian's source packages, whatever sources this machine's own apt knows.

# debian_sources FOLDER PACKAGE/SUITE...: downloads and unpacks them in FOLDER/source. The mirror is the one that this
# machine uses, and apt checks every file against what Debian has signed.
debian_sources() {
    local folder=$1 apt=$1/apt mirror
    shift
    mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 2>/dev/null | grep -m 1 '/debian/*$' || true)
    [[ -n $mirror ]] || { echo "${0##*/}: this machine's apt has no source of Debian" >&2; return 2; }
    mkdir -p "$apt/lists/partial" "$folder/source"
    printf "deb-src [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] $mirror %s main\n" bookworm trixie >"$apt/sources.list"
    local options=(-q -o "Dir::Etc::sourcelist=$apt/sources.list" -o Dir::Etc::sourceparts=- -o "Dir::State::lists=$apt/lists" -o APT::Get::List-Cleanup=0)
    apt-get "${options[@]}" update >/dev/null
    (cd "$folder/source" && apt-get "${options[@]}" source "$@") >"$folder/source.log" 2>&1 ||
        { tail "$folder/source.log" >&2; return 1; }
}
