# bash completion of impactbeam, impactbeam-paper, impactbeam-benchmark and impactbeam-plot
_impactbeam() {
  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]} IFS=$'\n'
  compopt -o filenames 2> /dev/null
  case $before in
    --out) COMPREPLY=($(compgen -d -- "$word")); return ;;
    --threads) COMPREPLY=(); return ;;
    --format) COMPREPLY=($(compgen -W $'csv\njson' -- "$word")); return ;;
    --new) COMPREPLY=($(compgen -W $'beam\nrelay\ntube\nreed' -- "$word")); return ;;
  esac
  if [[ $word == -* ]]; then
    COMPREPLY=($(compgen -W $'--out\n--check\n--estimate\n--format\n--threads\n--quiet\n--new\n--names\n--markdown\n--version\n--help' -- "$word"))
  else
    COMPREPLY=($(compgen -d -- "$word") $(compgen -f -X '!*.nml' -- "$word"))
  fi
}

_impactbeam_plot() {
  local word=${COMP_WORDS[COMP_CWORD]} IFS=$'\n'
  if ((COMP_CWORD == 1)); then
    COMPREPLY=($(compgen -W "$(impactbeam-plot --help 2> /dev/null | sed -n 's/^WHAT: //p' | tr -d ' ' | tr , '\n')" -- "$word"))
  else
    compopt -o filenames 2> /dev/null
    COMPREPLY=($(compgen -d -- "$word") $(compgen -f -X '!*.h5' -- "$word"))
  fi
}

complete -F _impactbeam impactbeam impactbeam-paper impactbeam-benchmark
complete -F _impactbeam_plot impactbeam-plot
