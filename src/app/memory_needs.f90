!> The memory that a scene needs, estimated before it runs. The estimate is the size of the arrays that grow with the
!> scene, at the moment when most of them are allocated. Measured, a large scene takes 0.7 to 1.2 times as much.
module memory_needs
   use failures, only: fail, failure_t, status_bad_input
   use kinds, only: wp
   use lapack_interfaces, only: blas_buffer
   use name_types, only: max_stored_numbers
   use number_text, only: to_text
   use process, only: free_addresses, free_memory, in_bytes
   implicit none (type, external)
   private
   public :: memory_need_t, check_need, add_need, add_modes, add_samples, short_text, overhead, bytes_of_number

   !> Bytes of a real number.
   real(wp), parameter :: bytes_of_number = 8.0_wp
   !> Bytes of libraries and small arrays.
   real(wp), parameter :: overhead = 1.6e7_wp
   !> Maximum number n of elements for which the length 2 (2 n)^2 + 12 n of LAPACK's workspace for all modes does not
   !> exceed the largest default integer.
   integer, parameter :: max_dense_elements = 16383

   !> The memory that a scene needs, and the parts of the message if the memory does not suffice.
   type :: memory_need_t
      !> Total number of bytes
      real(wp) :: bytes = overhead
      !> Bytes of the largest contribution
      real(wp) :: largest_bytes = 0.0_wp
      !> Purpose of the largest contribution
      character(:), allocatable :: purpose
      !> Advice how to reduce the largest contribution or, with `refusal`, what to change
      character(:), allocatable :: advice
      !> Reason why no amount of memory suffices; unallocated: there is none
      character(:), allocatable :: refusal
   end type memory_need_t

contains

   !> Refuse a need that exceeds the free memory.
   subroutine check_need(need, error)
      type(memory_need_t), intent(in) :: need
      !> Set if the need is refused
      type(failure_t), allocatable, intent(inout) :: error

      ! a smaller need is accepted unchecked, because to ask the operating system takes as long as a short run
      real(wp), parameter :: unchecked_bytes = 2.0_wp*overhead
      ! free memory, bytes
      real(wp) :: memory
      ! free address space (limited by ulimit -v), bytes
      real(wp) :: addresses

      if (allocated(need%refusal)) then
         call fail(error, status_bad_input, need%refusal//': '//need%advice)
         return
      end if
      if (.not. allocated(need%purpose) .or. need%bytes < unchecked_bytes) return
      memory = free_memory()
      ! the linear algebra library will allocate its buffer later
      addresses = free_addresses() - real(blas_buffer(), wp)
      if (need%bytes > memory) then
         call fail(error, status_bad_input, 'needs '//in_bytes(need%bytes)//' of memory, most of it for '// &
            need%purpose//', and '//in_bytes(memory)//' are free: '//need%advice)
      else if (need%bytes > addresses) then
         call fail(error, status_bad_input, 'needs '//in_bytes(need%bytes)//' of memory, most of it for '// &
            need%purpose//', and the limit (ulimit -v) leaves '//in_bytes(max(addresses, 0.0_wp))//': '//need%advice)
      end if
   end subroutine check_need

   !> Add a contribution to a need.
   pure subroutine add_need(need, bytes, purpose, advice)
      type(memory_need_t), intent(inout) :: need
      !> Bytes of the contribution
      real(wp), intent(in) :: bytes
      !> Purpose of the contribution
      character(*), intent(in) :: purpose
      !> Advice how to reduce the contribution
      character(*), intent(in) :: advice

      need%bytes = need%bytes + bytes
      if (bytes <= need%largest_bytes .or. allocated(need%refusal)) return
      need%largest_bytes = bytes
      need%purpose = purpose
      need%advice = advice
   end subroutine add_need

   !> Refuse a need whatever the free memory.
   pure subroutine refuse_need(need, refusal, advice)
      type(memory_need_t), intent(inout) :: need
      !> Reason of the refusal
      character(*), intent(in) :: refusal
      !> Advice what to change
      character(*), intent(in) :: advice

      if (allocated(need%refusal)) return
      need%refusal = refusal
      need%advice = advice
   end subroutine refuse_need

   !> Add the memory for all modes of a mesh of n elements by singular values (docs/theory.md, section 5), estimated as
   !> six full matrices of order 2 n for the flexibility matrix, its copy, singular vectors, mode shapes and workspace.
   subroutine add_modes(elements, computations, advice, need)
      integer, intent(in) :: elements
      !> Number of simultaneous computations of the modes
      integer, intent(in) :: computations
      !> Advice how to reduce the need
      character(*), intent(in) :: advice
      type(memory_need_t), intent(inout) :: need

      if (elements > max_dense_elements) then
         call refuse_need(need, 'the modes of '//to_text(elements)// &
            ' elements cannot be found at once, only those of up to '//to_text(max_dense_elements), advice)
      else
         call add_need(need, 6.0_wp*bytes_of_number*(2.0_wp*real(elements, wp))**2*real(computations, wp), &
            'all modes of '//to_text(elements)//' elements', advice)
      end if
   end subroutine add_modes

   !> Add the memory for the samples of one run; runs that follow each other use the same memory.
   subroutine add_samples(samples, numbers, group, advice, need)
      !> Number of samples of one run
      real(wp), intent(in) :: samples
      !> Number of values stored for each sample
      integer, intent(in) :: numbers
      !> Namelist group that requests the samples
      character(*), intent(in) :: group
      !> Advice how to reduce the number of samples
      character(*), intent(in) :: advice
      type(memory_need_t), intent(inout) :: need

      if (samples > max_stored_numbers) then
         call refuse_need(need, group//' has '//short_text(samples)//' samples in a run, more than '// &
            short_text(max_stored_numbers), advice)
      else
         call add_need(need, real(numbers, wp)*bytes_of_number*samples, &
            'runs of '//short_text(samples)//' samples', &
            advice)
      end if
   end subroutine add_samples

   !> A number as text, with two digits if it is large.
   pure function short_text(number) result(text)
      real(wp), intent(in) :: number
      character(:), allocatable :: text

      real(wp), parameter :: max_exact = 1.0e6_wp
      character(16) :: digits

      if (number < max_exact) then
         text = to_text(nint(number))
      else
         write (digits, '(es8.1)') number
         text = trim(adjustl(digits))
      end if
   end function short_text

end module memory_needs
