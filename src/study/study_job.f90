!> How a scene is to be done.
module study_job
   implicit none (type, external)
   private
   public :: job_t

   type :: job_t
      !> Folder of the results, which is there; the results file in it is claimed
      character(:), allocatable :: folder
      !> Threads of a sweep; 0: as many as there are cores
      integer :: threads = 0
      !> No tables, no progress
      logical :: quiet = .false.
      !> Where tables go
      integer :: unit = 0
      !> What the progress is called
      character(:), allocatable :: label
   end type job_t

end module study_job
