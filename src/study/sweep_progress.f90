!> Progress of a sweep: cases done, cases per second and remaining time; on a terminal in one line that is updated,
!> otherwise in one line each minute.
module sweep_progress
   use, intrinsic :: iso_fortran_env, only: error_unit
   use file_system, only: is_terminal, standard_error_descriptor
   use kinds, only: i8, wp
   use number_text, only: to_text
   use progress_line, only: terminal_width
   implicit none (type, external)
   private
   public :: progress_t, start_sweep_progress, print_sweep_progress, erase_sweep_progress, progress_words, rate_in_words

   !> State of the progress output.
   type :: progress_t
      !> Whether progress is printed
      logical :: is_wanted = .false.
      !> Whether the unit is a terminal
      logical :: on_terminal = .false.
      !> Unit for output
      integer :: unit = error_unit
      !> Minimum interval between two lines, seconds
      real(wp) :: pause = 0.0_wp
      !> Label of the lines
      character(:), allocatable :: label
      !> Number of all cases
      integer :: cases = 0
      !> Number of cases that previous runs have completed
      integer :: before = 0
      !> Clock at the start, in ticks
      integer(i8) :: start = 0_i8
      !> Clock at the last line, in ticks
      integer(i8) :: last = 0_i8
      !> Clock ticks per second
      integer(i8) :: rate = 1_i8
      !> Whether a line has been printed and not been erased
      logical :: has_line = .false.
   end type progress_t

contains

   !> Initialise the progress output.
   subroutine start_sweep_progress(is_wanted, label, cases, before, progress)
      !> Whether to print progress
      logical, intent(in) :: is_wanted
      !> Name of the sweep
      character(*), intent(in) :: label
      !> Number of all cases
      integer, intent(in) :: cases
      !> Number of cases that previous runs have completed
      integer, intent(in) :: before
      !> Initialised state
      type(progress_t), intent(out) :: progress

      progress%is_wanted = is_wanted
      progress%on_terminal = is_terminal(standard_error_descriptor)
      progress%pause = merge(1.0_wp, 60.0_wp, progress%on_terminal)
      progress%label = label
      progress%cases = cases
      progress%before = before
      call system_clock(progress%start, progress%rate)
      progress%last = progress%start
   end subroutine start_sweep_progress

   !> Print the progress, if the interval since the last line has passed.
   subroutine print_sweep_progress(progress, done)
      type(progress_t), intent(inout) :: progress
      !> Number of cases done by this and previous runs
      integer, intent(in) :: done

      character(:), allocatable :: words
      integer(i8) :: now
      integer :: status, width

      if (.not. progress%is_wanted) return
      call system_clock(now)
      if (real(now - progress%last, wp) < progress%pause*real(progress%rate, wp)) return
      progress%last = now
      progress%has_line = .true.
      ! assigned, not associated: gfortran 12 frees the result of a function under `associate` twice
      words = progress_words(progress%label, progress%cases, done, done - progress%before, &
         real(now - progress%start, wp)/real(progress%rate, wp))
      if (progress%on_terminal) then
         ! a line that wraps around could not be overwritten
         width = min(len(words), terminal_width(standard_error_descriptor) - 1)
         ! carriage return before, and the terminal's command to erase the rest of the line after the text
         write (progress%unit, '(a)', advance='no', iostat=status) achar(13)//words(:width)//achar(27)//'[K'
         flush (progress%unit, iostat=status)
      else
         write (progress%unit, '(a)', iostat=status) words
      end if
   end subroutine print_sweep_progress

   !> Erase the line on the terminal.
   subroutine erase_sweep_progress(progress)
      type(progress_t), intent(inout) :: progress

      integer :: status

      if (progress%has_line .and. progress%on_terminal) then
         write (progress%unit, '(a)', advance='no', iostat=status) achar(13)//achar(27)//'[K'
         flush (progress%unit, iostat=status)
      end if
      progress%has_line = .false.
   end subroutine erase_sweep_progress

   !> The progress in words, such as 'name: 5000 of 100000 cases, 6100 a second, 16 s left'.
   pure function progress_words(label, cases, done, computed, seconds) result(words)
      !> Name of the sweep
      character(*), intent(in) :: label
      !> Number of all cases
      integer, intent(in) :: cases
      !> Number of cases done
      integer, intent(in) :: done
      !> Number of cases done in this run
      integer, intent(in) :: computed
      !> Duration of this run in seconds
      real(wp), intent(in) :: seconds
      character(:), allocatable :: words

      real(wp) :: left

      words = label//': '//to_text(done)//' of '//to_text(cases)//' cases'
      if (computed == 0 .or. .not. seconds > 0.0_wp) return
      left = real(cases - done, wp)*seconds/real(computed, wp)
      words = words//', '//rate_in_words(computed, seconds, '')//', '
      if (left < 600.0_wp) then
         words = words//to_text(nint(left))//' s left'
      else if (left < 36000.0_wp) then
         words = words//to_text(nint(left/60.0_wp))//' min left'
      else
         words = words//to_text(nint(min(left/3600.0_wp, 1.0e9_wp)))//' h left'
      end if
   end function progress_words

   !> A rate of cases in words, such as '6100 cases a second', '0.41 cases a second' or '25 s a case'.
   pure function rate_in_words(computed, seconds, noun) result(words)
      !> Number of cases, > 0
      integer, intent(in) :: computed
      !> Time that they took, seconds
      real(wp), intent(in) :: seconds
      !> Words between number and 'a second'
      character(*), intent(in) :: noun
      character(:), allocatable :: words

      real(wp) :: rate

      rate = real(computed, wp)/max(seconds, 1.0e-3_wp)
      if (rate >= 10.0_wp) then
         words = to_text(nint(rate))//noun//' a second'
      else if (rate >= 0.1_wp) then
         words = to_text(real(nint(100.0_wp*rate), wp)/100.0_wp)//noun//' a second'
      else
         words = to_text(nint(1.0_wp/rate))//' s a case'
      end if
   end function rate_in_words

end module sweep_progress
