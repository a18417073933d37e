# After find_package(HDF5 COMPONENTS Fortran HL): where the wrapper compiler cannot be asked, for which a blank in the path
# of the build is enough, CMake names the library hdf5_hl_fortran, though hdf5hl_fortran is what it found.
if(TARGET hdf5::hdf5_hl_fortran AND HDF5_hdf5hl_fortran_LIBRARY AND NOT HDF5_hdf5_hl_fortran_LIBRARY)
  set_target_properties(hdf5::hdf5_hl_fortran PROPERTIES IMPORTED_LOCATION "${HDF5_hdf5hl_fortran_LIBRARY}")
endif()
