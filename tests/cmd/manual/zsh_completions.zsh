# SPDX-License-Identifier: Apache-2.0
# Prints the completions that zsh offers for each line, in a pseudo-terminal:
#   zsh -f zsh_completions.zsh FOLDER HITS LINE...
# FOLDER has the completion scripts; HITS is a file that collects the offers.
zmodload zsh/zpty zsh/zselect
folder=$1 hits=$2
shift 2
cat > $hits.rc <<EOF
PS1= LISTMAX=10000 fpath=($folder \$fpath)
autoload -U compinit
compinit -u -D
unsetopt zle_bracketed_paste automenu autolist beep
compadd() {
    # Stores words in an array for the caller; offers nothing yet.
    [[ \${@[1,(i)(-|--)]} == *-(O|A|D)\ * ]] && { builtin compadd "\$@"; return }
    local -a found
    builtin compadd -A found "\$@"
    builtin compadd "\$@"
    local result=\$?
    print -lr -- \$found >> $hits
    return result
}
list() {
    zle list-choices
    print -r -- "== \$BUFFER" >> $hits
    zle kill-whole-line
}
zle -N list
bindkey '^T' list
print ready >> $hits
EOF
: > $hits
zpty shell zsh -f -i
zpty -w shell "source $hits.rc"

# Waits for a line in HITS. Reads the shell's output meanwhile, because the shell stops when the terminal is full.
wait_for() {
    local -i attempts
    for ((attempts = 0; attempts < 1200; ++attempts)); do
        grep -qxF -- "$1" $hits && return
        while zpty -rt shell rest; do :; done
        zselect -t 5
    done
    print "zsh does not come to: $1"
    exit 1
}
wait_for ready
for line; do
    zpty -n -w shell "$line"$'\x14'
    wait_for "== $line"
done
zpty -d shell
cat $hits
