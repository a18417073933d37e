!> Job: where the results of a study are stored, where and whether they are printed, and by how many threads they are
!> computed.
module study_job
   implicit none (type, external)
   private
   public :: job_t

   !> Options of a study, in part from the command line.
   type :: job_t
      !> Folder of the results, which exists; the name of the results file in it is reserved for this run
      character(:), allocatable :: folder
      !> Number of threads of a sweep; 0: as many as the machine has cores
      integer :: threads = 0
      !> Whether to print neither tables nor progress
      logical :: quiet = .false.
      !> Fortran unit to which tables are printed, opened by the caller of the study; 0: not opened
      integer :: unit = 0
      !> Label of the progress line
      character(:), allocatable :: label
   end type job_t

end module study_job
