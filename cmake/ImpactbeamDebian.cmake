# What Debian wants of a package besides, run by CPack on what was installed for it: licence and list of changes under its own
# names, pages and changes compressed, completion for zsh where Debian's zsh looks.
file(GLOB documents "${CPACK_TEMPORARY_DIRECTORY}/usr/share/doc/*")
file(RENAME "${documents}/LICENSE" "${documents}/copyright")
file(RENAME "${documents}/CHANGELOG.md" "${documents}/changelog")
file(READ "${documents}/README.md" readme)
string(REPLACE "(CHANGELOG.md)" "(changelog.gz)" readme "${readme}")
file(WRITE "${documents}/README.md" "${readme}")
file(RENAME "${CPACK_TEMPORARY_DIRECTORY}/usr/share/zsh/site-functions" "${CPACK_TEMPORARY_DIRECTORY}/usr/share/zsh/vendor-completions")
file(GLOB pages "${CPACK_TEMPORARY_DIRECTORY}/usr/share/man/man1/*.1")
execute_process(COMMAND gzip -9n "${documents}/changelog" ${pages} COMMAND_ERROR_IS_FATAL ANY)
# Debian asks for a maintainer's mail address. There is none, and one that looks as if there were would be worse.
file(WRITE "${CPACK_TEMPORARY_DIRECTORY}/usr/share/lintian/overrides/impactbeam"
  "# the project has no mail address\nimpactbeam: bogus-mail-host\n")
