# Shared by ./run, ./test and .ci/run: installs what is missing, configures, builds. To be sourced; $root is the checkout.
# Each step says what it does; a step with nothing to do says nothing.

say() { printf '\033[1m%s\033[0m\n' "$*" >&2; }

fail() {
    printf '%s: %s\n' "$(basename "$0")" "$*" >&2
    exit 2
}

# install_packages GROUP...: the packages of these groups that are not installed yet.
install_packages() {
    command -v dpkg-query >/dev/null || {
        say "This is not a Debian system: install the packages of .ci/packages.txt by their names there. Going on."
        return 0
    }
    local missing=() group name
    while read -r group name; do
        [[ " $* " == *" $group "* ]] || continue
        [ "$(dpkg-query -W -f '${db:Status-Status}' "$name" 2>/dev/null)" = installed ] || missing+=("$name")
    done < <(grep -v '^#' "$root/.ci/packages.txt")
    [ ${#missing[@]} -gt 0 ] || return 0
    local as_root=()
    if [ "$(id -u)" != 0 ]; then
        command -v sudo >/dev/null || fail "these packages are missing, and neither root nor sudo is at hand: ${missing[*]}"
        as_root=(sudo)
    fi
    say "Installing ${#missing[@]} Debian packages: ${missing[*]}"
    "${as_root[@]}" apt-get update -q >&2 || say "apt-get update failed; trying with the lists at hand"
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends "${missing[@]}" >&2 ||
        fail "apt-get could not install: ${missing[*]}; see its message above"
}

# configure DIR OPTION...: runs cmake unless DIR was configured with the same options before.
configure() {
    local dir=$1
    shift
    local wanted="$*"
    if [ -f "$dir/build.ninja" ] && [ "$(cat "$dir/.options" 2>/dev/null)" = "$wanted" ]; then return 0; fi
    say "Configuring in ${dir#"$root"/}"
    cmake -S "$root" -B "$dir" -G Ninja "$@" >&2 || fail "cmake could not configure; see its message above"
    printf '%s' "$wanted" >"$dir/.options"
}

# Processors older than 2013 lack what the default build uses.
architecture() { grep -qm1 'avx2.*' /proc/cpuinfo && echo x86-64-v3 || echo x86-64; }

# build DIR TARGET...: ninja shows its own progress, and nothing when there is nothing to do.
build() {
    local dir=$1
    shift
    if ninja -C "$dir" -n "$@" 2>/dev/null | grep -q 'no work to do'; then return 0; fi
    say "Building"
    ninja -C "$dir" "$@" >&2 && return 0
    [ $? -eq 130 ] && fail "interrupted; the same command goes on where it was"
    fail "the build failed; see the compiler's message above"
}

# build_release: what is tested and measured, in build.
build_release() {
    configure "$root/build" -DCMAKE_BUILD_TYPE=Release -DCALOT_BUILD_TESTS=ON -DCALOT_BUILD_MESHER=ON \
        -DCALOT_ARCHITECTURE="$(architecture)"
    build "$root/build"
}
