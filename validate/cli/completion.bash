_validate() {
  local cur="${COMP_WORDS[COMP_CWORD]}" prev="${COMP_WORDS[COMP_CWORD-1]}" words="" files=1
  COMPREPLY=()
  if [ "$COMP_CWORD" -eq 1 ]; then
    COMPREPLY=($(compgen -W "@commands --help --version" -- "$cur"))
    return
  fi
  case "$prev" in
    @of_a_scene)
      local scene key given="${cur//\\/}"
      for scene in "${COMP_WORDS[@]:2}"; do
        case "$scene" in
          *.toml|@examples)
            while IFS= read -r key; do
              case "$key" in "$given"*) COMPREPLY+=("$key$([ "$prev" = --calibrate ] || echo =)") ;; esac
            done < <(validate completion keys "${scene//\\/}" 2> /dev/null)
            type compopt > /dev/null 2>&1 && compopt -o nospace
            return ;;
        esac
      done ;;
  esac
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
