# `cmake --install`: programs, scripts, scenes, pages, completion, and the library for programs of others. Nothing that is
# installed knows where it is.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(share "${CMAKE_INSTALL_DATADIR}/impactbeam")
set(scripts_folder "${share}/scripts")
set(modules_folder "${CMAKE_INSTALL_LIBDIR}/impactbeam/modules")
set(packages_folder "${CMAKE_INSTALL_LIBDIR}/cmake/impactbeam")

# Without the symbols, which only debuggers read
install(CODE "set(CMAKE_INSTALL_DO_STRIP TRUE)")
install(TARGETS impactbeam impactbeam-paper impactbeam-benchmark RUNTIME)
if(TARGET impactbeam_ranks)
  set(chunk_folder "${CMAKE_INSTALL_LIBDIR}/impactbeam")
  install(TARGETS impactbeam_ranks LIBRARY DESTINATION "${chunk_folder}")
  file(RELATIVE_PATH parts_from_programs "/${CMAKE_INSTALL_BINDIR}" "/${chunk_folder}")
  set_property(TARGET impactbeam impactbeam-paper impactbeam-benchmark
    APPEND PROPERTY INSTALL_RPATH "\$ORIGIN/${parts_from_programs}")
endif()
install(DIRECTORY inputs/ DESTINATION "${share}/examples" FILES_MATCHING PATTERN "*.nml" PATTERN "*.txt" PATTERN "*.csv")
install(DIRECTORY packaging/example/ DESTINATION "${share}/examples/library")
install(DIRECTORY scripts/ DESTINATION "${scripts_folder}" USE_SOURCE_PERMISSIONS
  FILES_MATCHING PATTERN "*.py" PATTERN "impactbeam-plot" PATTERN "__pycache__" EXCLUDE)
file(RELATIVE_PATH scripts_from_programs "/${CMAKE_INSTALL_BINDIR}" "/${scripts_folder}")
install(CODE "file(MAKE_DIRECTORY \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_BINDIR}\")
  file(CREATE_LINK \"${scripts_from_programs}/impactbeam-plot\"
    \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_BINDIR}/impactbeam-plot\" SYMBOLIC)")
install(FILES LICENSE README.md CHANGELOG.md CITATION.cff DESTINATION "${CMAKE_INSTALL_DOCDIR}")
install(DIRECTORY docs DESTINATION "${CMAKE_INSTALL_DOCDIR}" FILES_MATCHING PATTERN "*.md" PATTERN "*.svg")
configure_file(packaging/impactbeam.1.in impactbeam.1 @ONLY)
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/impactbeam.1" DESTINATION "${CMAKE_INSTALL_MANDIR}/man1")
# It is the page of the others too.
file(WRITE "${CMAKE_CURRENT_BINARY_DIR}/same.1" ".so man1/impactbeam.1\n")
foreach(program IN ITEMS paper benchmark plot)
  install(FILES "${CMAKE_CURRENT_BINARY_DIR}/same.1" DESTINATION "${CMAKE_INSTALL_MANDIR}/man1" RENAME impactbeam-${program}.1)
endforeach()
install(FILES packaging/completion/impactbeam.bash RENAME impactbeam
  DESTINATION "${CMAKE_INSTALL_DATADIR}/bash-completion/completions")
install(FILES packaging/completion/_impactbeam DESTINATION "${CMAKE_INSTALL_DATADIR}/zsh/site-functions")

# One archive of all folders, so that others link one library.
set(objects "")
foreach(folder IN ITEMS base posix system settings namelist scene blas_threads algebra beam frequencies modes signals contact loads
    observe phases exact newmark motion periodic storage output analysis study inference app)
  list(APPEND objects "$<TARGET_OBJECTS:impactbeam_${folder}>")
endforeach()
add_library(impactbeam_archive STATIC ${objects})
set_target_properties(impactbeam_archive PROPERTIES OUTPUT_NAME impactbeam EXPORT_NAME impactbeam LINKER_LANGUAGE Fortran)
target_link_libraries(impactbeam_archive INTERFACE hdf5::hdf5_fortran hdf5::hdf5_hl_fortran LAPACK::LAPACK ZLIB::ZLIB
  cminpack::cminpack m
  ${CMAKE_DL_LIBS} $<$<BOOL:${OpenMP_Fortran_FOUND}>:OpenMP::OpenMP_Fortran>)
target_include_directories(impactbeam_archive INTERFACE "$<INSTALL_INTERFACE:${modules_folder}>")
install(TARGETS impactbeam_archive EXPORT impactbeam-targets ARCHIVE)
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/src/app/modules/impactbeam_library.mod" DESTINATION "${modules_folder}")
install(EXPORT impactbeam-targets NAMESPACE impactbeam:: DESTINATION "${packages_folder}")
configure_package_config_file(packaging/impactbeam-config.cmake.in impactbeam-config.cmake
  INSTALL_DESTINATION "${packages_folder}" PATH_VARS modules_folder)
write_basic_package_version_file(impactbeam-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/impactbeam-config.cmake"
  "${CMAKE_CURRENT_BINARY_DIR}/impactbeam-config-version.cmake"
  cmake/ImpactbeamHDF5.cmake cmake/ImpactbeamCMinpack.cmake DESTINATION "${packages_folder}")

# pkg-config has no targets: the libraries of others by name, with their folder where the linker does not know it.
set(libraries_of_others "")
set(libraries ${HDF5_Fortran_HL_LIBRARIES} ${HDF5_Fortran_LIBRARIES} ${LAPACK_LIBRARIES} ${ZLIB_LIBRARIES} ${CMINPACK_LIBRARY})
list(FILTER libraries EXCLUDE REGEX "NOTFOUND$")
list(REMOVE_DUPLICATES libraries)
foreach(library IN LISTS libraries)
  cmake_path(GET library PARENT_PATH folder)
  cmake_path(GET library STEM name)
  string(REGEX REPLACE "^lib" "" name "${name}")
  if(NOT folder)
    list(APPEND libraries_of_others "${library}")
  elseif(folder IN_LIST CMAKE_C_IMPLICIT_LINK_DIRECTORIES)
    list(APPEND libraries_of_others "-l${name}")
  else()
    list(APPEND libraries_of_others "-L${folder}" "-l${name}")
  endif()
endforeach()
list(APPEND libraries_of_others ${OpenMP_Fortran_FLAGS} -lm ${dl})
list(REMOVE_DUPLICATES libraries_of_others)
list(JOIN libraries_of_others " " libraries_of_others)
file(RELATIVE_PATH prefix_from_pc "/${CMAKE_INSTALL_LIBDIR}/pkgconfig" "/")
string(REGEX REPLACE "/$" "" prefix_from_pc "${prefix_from_pc}")
configure_file(packaging/impactbeam.pc.in impactbeam.pc @ONLY)
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/impactbeam.pc" DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig")

# `cmake --workflow --preset package` makes a .deb: without native flags and MPI, for any processor of its kind.
set(CPACK_PACKAGE_CONTACT "The impactbeam developers <impactbeam@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_RESOURCE_FILE_LICENSE "${PROJECT_SOURCE_DIR}/LICENSE")
set(CPACK_PACKAGING_INSTALL_PREFIX "/usr")
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_PACKAGE_SECTION "science")
set(CPACK_DEBIAN_PACKAGE_DESCRIPTION "Finite elements and exact motion from event to event, from namelist scenes to
HDF5 files and pictures: impacts, rebounds, chatter, sweeps of thousands of
cases, statistics, stresses and periodic motions.")
set(CPACK_PRE_BUILD_SCRIPTS "${PROJECT_SOURCE_DIR}/cmake/ImpactbeamDebian.cmake")
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "python3, python3-h5py, python3-matplotlib")
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "gfortran, libhdf5-dev, libopenblas-dev, zlib1g-dev, libcminpack-dev")
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
include(CPack)
