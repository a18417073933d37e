!> The right to write the results of a scene: one run at a time, and only in place of what an earlier run wrote.
module results_claim
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_null_char, c_size_t
   use failures, only: fail, failure_t, status_run_failed
   use file_system, only: kind_file, kind_folder, kind_link, kind_nothing, kind_of, reason
   use hdf5_loading, only: hdf5_source_t
   use program_identity, only: program_name
   implicit none (type, external)
   private
   public :: claim_t, claim_results, release_results, refuse_foreign

   !> A claim; the system takes it back when the process ends, however it ends.
   type :: claim_t
      private
      !> The file that is locked; unallocated: there is no claim
      character(:), allocatable :: path
      integer(c_int) :: descriptor = -1_c_int
   end type claim_t

   interface
      ! Explained in results_lock_posix.c.
      function impactbeam_lock(path, file, owner, size) bind(c) result(code)
         import :: c_char, c_int, c_size_t
         implicit none (type, external)
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), intent(out) :: file
         character(kind=c_char), intent(inout) :: owner(*)
         integer(c_size_t), value :: size
         integer(c_int) :: code
      end function impactbeam_lock

      subroutine impactbeam_unlock(path, file) bind(c)
         import :: c_char, c_int
         implicit none (type, external)
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value :: file
      end subroutine impactbeam_unlock
   end interface

contains

   !> Claim a results file before it is computed.
   subroutine claim_results(folder, name, claim, error)
      !> Folder of the results, which is there
      character(*), intent(in) :: folder
      !> Name of the results file in it
      character(*), intent(in) :: name
      !> To be given back to `release_results`
      type(claim_t), intent(out) :: claim
      !> Why it cannot be had: another run has it, or the name is that of a file of the user's
      type(failure_t), allocatable, intent(out) :: error

      integer(c_int), parameter :: is_constrained = -1_c_int, is_foreign = -2_c_int
      integer(c_size_t), parameter :: longest_owner = 400_c_size_t
      character(longest_owner, kind=c_char) :: owner
      character(:), allocatable :: lock, path
      integer(c_int) :: code, descriptor

      path = folder//'/'//name
      lock = folder//'/.'//name//'.lock'
      code = impactbeam_lock(lock//c_null_char, descriptor, owner, longest_owner)
      select case (code)
      case (0_c_int)
         claim%path = lock
         claim%descriptor = descriptor
         if (.not. is_result(path)) call refuse_foreign(path, 'a results file', error)
         if (allocated(error)) call release_results(claim)
      case (is_constrained)
         call fail(error, status_run_failed, "'"//path//"' is being computed by "// &
            owner(:index(owner, c_null_char) - 1)//'; wait for it, or give another name or --out')
      case (is_foreign)
         call refuse_foreign(lock, 'a lock', error)
      case default
         call fail(error, status_run_failed, "cannot write in '"//folder//"': "//reason(code))
      end select
   end subroutine claim_results

   !> Let others have it; without a claim nothing happens.
   subroutine release_results(claim)
      type(claim_t), intent(inout) :: claim

      if (.not. allocated(claim%path)) return
      call impactbeam_unlock(claim%path//c_null_char, claim%descriptor)
      deallocate (claim%path)
   end subroutine release_results

   !> Say that a name is taken by what the program did not write.
   subroutine refuse_foreign(path, wanted, error)
      !> What is there
      character(*), intent(in) :: path
      !> What the program would have written there
      character(*), intent(in) :: wanted
      !> The refusal
      type(failure_t), allocatable, intent(inout) :: error

      call fail(error, status_run_failed, "'"//path//"' is "//what_is_there(path)//', and not '//wanted// &
         ' that impactbeam wrote; it stays as it is: move it away, or give another name or --out')
   end subroutine refuse_foreign

   !> The kind of a file in words.
   function what_is_there(path) result(words)
      character(*), intent(in) :: path
      character(:), allocatable :: words

      select case (kind_of(path))
      case (kind_file)
         words = 'a file'
      case (kind_folder)
         words = 'a folder'
      case (kind_link)
         words = 'a link'
      case default
         words = 'no file'
      end select
   end function what_is_there

   !> Is there nothing of that name, or a results file of the program?
   function is_result(path) result(answer)
      character(*), intent(in) :: path
      logical :: answer

      type(hdf5_source_t) :: file

      answer = kind_of(path) == kind_nothing
      if (kind_of(path) /= kind_file) return
      call file%open_file(path)
      answer = file%text_attribute('program') == program_name
      call file%close_source()
   end function is_result

end module results_claim
