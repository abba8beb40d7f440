# Presses the tabulator key behind a line in an interactive zsh, and writes what became of it.
#     zsh -f press_tab.zsh LINE COMPLETION FILE
zmodload zsh/zpty

# Reads what the shell prints until it has printed the word.
awaitWord() {
  local piece all=
  for try in {1..1200}; do
    if zpty -r -t shell piece 2>/dev/null; then
      all+=$piece
      [[ $all = *$1* ]] && return
    else
      sleep 0.05
    fi
  done
  print -r -- "the shell does not answer: $all"
}

zpty -b shell "TERM=dumb zsh -f -i"
zpty -w shell "PS1=; autoload -U compinit; compinit -u -D; source $2"
zpty -w shell "writeLine() { print -r -- \$BUFFER > $3; print; print WRIT''TEN; }; zle -N writeLine; bindkey '^T' writeLine"
zpty -w shell "PS1='RE''ADY'"
awaitWord READY
zpty -w -n shell "$1"$'\t'
zpty -w -n shell $'\x14'
awaitWord WRITTEN
zpty -d shell
