!> The claim of a run on its results file, made by locking a file beside it: one run at a time may write the results
!> file, and the run may only replace a file that the program wrote.
module results_claim
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_null_char, c_size_t
   use failures, only: fail, failure_t, status_run_failed
   use file_system, only: kind_file, kind_link, kind_nothing, kind_of, make_folder, problem_with_reading, reason, &
      test_folder
   use hdf5_loading, only: hdf5_source_t
   use program_identity, only: program_name
   implicit none (type, external)
   private
   public :: claim_t, claim_results, release_results, refuse_foreign

   !> A claim on a results file. The operating system releases the claim when the process ends, however the process
   !> ends.
   type :: claim_t
      private
      !> Path of the lock file; unallocated: there is no claim
      character(:), allocatable :: path
      !> File descriptor of the lock file
      integer(c_int) :: descriptor = -1_c_int
   end type claim_t

   interface
      ! The functions are documented in results_lock_posix.c. `owner` is a text that names the process with the lock,
      ! and `size` its maximum length.
      function impactbeam_lock(path, descriptor, owner, size) bind(c) result(code)
         import :: c_char, c_int, c_size_t
         implicit none (type, external)
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), intent(out) :: descriptor
         character(kind=c_char), intent(inout) :: owner(*)
         integer(c_size_t), value :: size
         integer(c_int) :: code
      end function impactbeam_lock

      subroutine impactbeam_unlock(path, descriptor) bind(c)
         import :: c_char, c_int
         implicit none (type, external)
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value :: descriptor
      end subroutine impactbeam_unlock
   end interface

contains

   !> Claim a results file before its contents are computed. Its folder is made if it does not exist.
   subroutine claim_results(folder, name, claim, error)
      !> Folder of the results
      character(*), intent(in) :: folder
      !> Name of the results file in `folder`
      character(*), intent(in) :: name
      !> The claim, to be released by `release_results`
      type(claim_t), intent(out) :: claim
      !> Set if another run has the claim, the folder refuses files, or the program did not write the file of this name
      type(failure_t), allocatable, intent(out) :: error

      ! results of impactbeam_lock besides 0 and the error codes of the operating system, which are positive
      integer(c_int), parameter :: is_locked = -1_c_int, is_foreign = -2_c_int
      integer(c_size_t), parameter :: max_owner_length = 400_c_size_t
      character(max_owner_length, kind=c_char) :: owner
      character(:), allocatable :: lock, path, problem
      type(hdf5_source_t) :: file
      ! Until the lock file is in the folder, another run that fails may remove the folder, which is then made again.
      integer, parameter :: max_attempts = 100
      integer :: attempt
      integer(c_int) :: code, descriptor
      logical :: is_writable

      path = folder//'/'//name
      lock = folder//'/.'//name//'.lock'
      do attempt = 1, max_attempts
         call make_folder(folder, error)
         if (allocated(error)) cycle
         code = impactbeam_lock(lock//c_null_char, descriptor, owner, max_owner_length)
         if (code <= 0_c_int) exit
      end do
      if (allocated(error)) return
      select case (code)
      case (0_c_int)
         claim%path = lock
         claim%descriptor = descriptor
         ! nothing may have the path, or a results file of the program
         is_writable = kind_of(path) == kind_nothing
         if (kind_of(path) == kind_file) then
            ! HDF5 would not report why it cannot open a file
            problem = problem_with_reading(path)
            if (problem /= '') call fail(error, status_run_failed, "cannot read '"//path// &
               "', which would be replaced: "//problem)
            call file%open_file(path)
            is_writable = file%text_attribute('program') == program_name
            call file%close_source()
         end if
         if (.not. is_writable) call refuse_foreign(path, 'a results file', error)
         ! a folder that cannot be written is reported before a long run, not after it
         if (.not. allocated(error)) call test_folder(folder, error)
         if (allocated(error)) call release_results(claim)
      case (is_locked)
         call fail(error, status_run_failed, "'"//path//"' is being computed by "// &
            owner(:index(owner, c_null_char) - 1)//'; wait for it, or give another name or --out')
      case (is_foreign)
         call refuse_foreign(lock, 'a lock', error)
      case default
         call fail(error, status_run_failed, "cannot write in the folder '"//folder//"': "//reason(code))
      end select
   end subroutine claim_results

   !> Release a claim. Without a claim nothing happens.
   subroutine release_results(claim)
      type(claim_t), intent(inout) :: claim

      if (.not. allocated(claim%path)) return
      call impactbeam_unlock(claim%path//c_null_char, claim%descriptor)
      deallocate (claim%path)
   end subroutine release_results

   !> Make the failure that a file, folder or link which the program did not write has the path of a file to be written.
   subroutine refuse_foreign(path, wanted, error)
      !> Path of the existing file, folder or link
      character(*), intent(in) :: path
      !> Description of the file that the program would have written
      character(*), intent(in) :: wanted
      !> The failure
      type(failure_t), allocatable, intent(inout) :: error

      character(*), parameter :: kinds(kind_file:kind_link) = [character(8) :: 'a file', 'a folder', 'a link']
      character(:), allocatable :: words
      integer :: kind

      ! devices and pipes are no files in this sense
      words = 'no file'
      kind = kind_of(path)
      if (kind >= kind_file .and. kind <= kind_link) words = trim(kinds(kind))
      call fail(error, status_run_failed, "'"//path//"' is "//words//', and not '//wanted// &
         ' that impactbeam wrote; it stays as it is: move it away, or give another name or --out')
   end subroutine refuse_foreign

end module results_claim
