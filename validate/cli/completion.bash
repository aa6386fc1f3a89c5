_validate() {
  local cur="${COMP_WORDS[COMP_CWORD]}" prev="${COMP_WORDS[COMP_CWORD-1]}" words="" files=1
  COMPREPLY=()
  if [ "$COMP_CWORD" -eq 1 ]; then
    COMPREPLY=($(compgen -W "@commands --help --version" -- "$cur"))
    return
  fi
  case "${COMP_WORDS[1]}:$prev" in
@after    *)
      case "${COMP_WORDS[1]}" in
@cases      esac ;;
  esac
  COMPREPLY=($(compgen -W "$words" -- "$cur"))
  case "${COMPREPLY[0]}" in *=) type compopt > /dev/null 2>&1 && compopt -o nospace ;; esac
  case "$cur" in
    -*) ;;
    *)
      local IFS=$'\n'
      [ "$files" -eq 1 ] && COMPREPLY+=($(compgen -f -- "$cur")) ;;
  esac
}
complete -o filenames -F _validate validate
