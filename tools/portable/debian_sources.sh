# SPDX-License-Identifier: MIT
# To be sourced. Packages of Debian, whatever sources this machine's own apt knows. The mirror is the one that this
# machine uses, and apt checks every file against what Debian has signed.

# debian_apt FOLDER TYPE ARRAY: readies FOLDER/apt, and sets ARRAY to apt-get with it. TYPE: deb or deb-src.
debian_apt() {
    local apt=$1/apt mirror
    local -n command=$3
    mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 2>/dev/null | grep -m 1 '/debian/*$' || true)
    [[ -n $mirror ]] || { echo "${0##*/}: this machine's apt has no source of Debian" >&2; return 2; }
    mkdir -p "$apt/lists/partial"
    printf "$2 [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] $mirror %s main\n" bookworm trixie >"$apt/sources.list"
    # shellcheck disable=SC2034
    command=(apt-get -q -o "Dir::Etc::sourcelist=$apt/sources.list" -o Dir::Etc::sourceparts=- -o "Dir::State::lists=$apt/lists"
        -o APT::Get::List-Cleanup=0)
    "${command[@]}" update >/dev/null
}

# debian_sources FOLDER PACKAGE/SUITE...: downloads and unpacks source packages in FOLDER/source.
debian_sources() {
    local folder=$1 get
    shift
    mkdir -p "$folder/source"
    debian_apt "$folder" deb-src get || return
    (cd "$folder/source" && "${get[@]}" source "$@") >"$folder/source.log" 2>&1 ||
        { tail "$folder/source.log" >&2; return 1; }
}

# debian_files FOLDER PACKAGE/SUITE...: downloads packages, and unpacks their files in FOLDER, without installing them.
debian_files() {
    local folder=$1 get file
    shift
    mkdir -p "$folder/packages"
    debian_apt "$folder" deb get || return
    (cd "$folder/packages" && "${get[@]}" download "$@") >"$folder/packages.log" 2>&1 ||
        { tail "$folder/packages.log" >&2; return 1; }
    for file in "$folder"/packages/*.deb; do dpkg-deb -x "$file" "$folder"; done
}
