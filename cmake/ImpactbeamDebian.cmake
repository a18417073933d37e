# What Debian wants of a package besides, run by CPack on what was installed for it: licence and list of changes under its own
# names, pages and changes compressed.
file(GLOB documents "${CPACK_TEMPORARY_DIRECTORY}/usr/share/doc/*")
file(RENAME "${documents}/LICENSE" "${documents}/copyright")
file(RENAME "${documents}/CHANGELOG.md" "${documents}/changelog")
file(GLOB pages "${CPACK_TEMPORARY_DIRECTORY}/usr/share/man/man1/*.1")
execute_process(COMMAND gzip -9n "${documents}/changelog" ${pages} COMMAND_ERROR_IS_FATAL ANY)
