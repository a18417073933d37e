!> What a scene needs of the machine, told before it runs. The figures are those of the arrays that grow with the scene,
!> at the moment when most of them are there; measured, a large scene takes 0.7 to 1.2 times as much.
module memory_needs
   use blas_threads, only: blas_buffer
   use failures, only: fail, failure_t, status_bad_input
   use kinds, only: wp
   use machine_memory, only: free_addresses, free_memory, in_bytes
   use number_text, only: to_text
   use value_rules, only: most_numbers
   implicit none (type, external)
   private
   public :: need_t, check_need, add_need, add_modes, add_samples, so_many, overhead, bytes_of_number

   real(wp), parameter :: bytes_of_number = 8.0_wp
   !> Libraries and small things.
   real(wp), parameter :: overhead = 1.6e7_wp
   !> LAPACK numbers the work space of the modes, 2 (2 n)^2 + 12 n, in 31 bits.
   integer, parameter :: most_dense = 16383

   type :: need_t
      !> Bytes in all
      real(wp) :: bytes = overhead
      !> The greatest of its parts, what it is for, and what would make it less
      real(wp) :: greatest = 0.0_wp
      character(:), allocatable :: purpose
      character(:), allocatable :: advice
      !> Why there is no number of bytes that would do
      character(:), allocatable :: refusal
   end type need_t

contains

   !> Refuse what there is no room for.
   subroutine check_need(need, error)
      type(need_t), intent(in) :: need
      !> Set when it does not fit
      type(failure_t), allocatable, intent(inout) :: error

      real(wp) :: memory, addresses

      if (allocated(need%refusal)) then
         call fail(error, status_bad_input, need%refusal//': '//need%advice)
         return
      end if
      if (.not. allocated(need%purpose)) return
      memory = free_memory()
      ! linear algebra has not begun yet
      addresses = free_addresses() - real(blas_buffer(), wp)
      if (need%bytes > memory) then
         call fail(error, status_bad_input, 'needs '//in_bytes(need%bytes)//' of memory, most of it for '// &
            need%purpose//', and '//in_bytes(memory)//' are free: '//need%advice)
      else if (need%bytes > addresses) then
         call fail(error, status_bad_input, 'needs '//in_bytes(need%bytes)//' of memory, most of it for '// &
            need%purpose//', and the limit (ulimit -v) leaves '//in_bytes(max(addresses, 0.0_wp))//': '//need%advice)
      end if
   end subroutine check_need

   !> One part of a need.
   pure subroutine add_need(need, bytes, purpose, advice)
      type(need_t), intent(inout) :: need
      !> The part's bytes, what they are for, and what would make them less
      real(wp), intent(in) :: bytes
      character(*), intent(in) :: purpose
      character(*), intent(in) :: advice

      need%bytes = need%bytes + bytes
      if (bytes <= need%greatest .or. allocated(need%refusal)) return
      need%greatest = bytes
      need%purpose = purpose
      need%advice = advice
   end subroutine add_need

   !> Refuse it whatever the memory.
   pure subroutine refuse_need(need, refusal, advice)
      type(need_t), intent(inout) :: need
      !> Why, and what to change
      character(*), intent(in) :: refusal
      character(*), intent(in) :: advice

      if (allocated(need%refusal)) return
      need%refusal = refusal
      need%advice = advice
   end subroutine refuse_need

   !> All modes of a mesh by singular values: the flexibility, its copy, vectors and their work space.
   subroutine add_modes(elements, solves, advice, need)
      integer, intent(in) :: elements
      !> So many at a time
      integer, intent(in) :: solves
      !> What would make it less
      character(*), intent(in) :: advice
      type(need_t), intent(inout) :: need

      if (elements > most_dense) then
         call refuse_need(need, 'the modes of '//to_text(elements)// &
            ' elements cannot be found at once, only those of up to '//to_text(most_dense), advice)
      else
         call add_need(need, 6.0_wp*bytes_of_number*(2.0_wp*real(elements, wp))**2*real(solves, wp), &
            'all modes of '//to_text(elements)//' elements', advice)
      end if
   end subroutine add_modes

   !> Runs one after the other, each with its samples.
   subroutine add_samples(samples, numbers, group, advice, need)
      !> Of one run
      real(wp), intent(in) :: samples
      !> Numbers kept for each at once
      integer, intent(in) :: numbers
      !> Who asks for them
      character(*), intent(in) :: group
      !> What would make them fewer
      character(*), intent(in) :: advice
      type(need_t), intent(inout) :: need

      if (samples > most_numbers) then
         call refuse_need(need, group//' has '//so_many(samples)//' samples in a run, more than '// &
            so_many(most_numbers), advice)
      else
         call add_need(need, real(numbers, wp)*bytes_of_number*samples, 'runs of '//so_many(samples)//' samples', &
            advice)
      end if
   end subroutine add_samples

   !> A large number, rounded where it is not to be counted.
   pure function so_many(number) result(words)
      real(wp), intent(in) :: number
      character(:), allocatable :: words

      real(wp), parameter :: countable = 1.0e6_wp
      character(16) :: digits

      if (number < countable) then
         words = to_text(nint(number))
      else
         write (digits, '(es8.1)') number
         words = trim(adjustl(digits))
      end if
   end function so_many

end module memory_needs
