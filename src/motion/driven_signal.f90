!> A signal of what swings of itself, and of what loads do to it besides (docs/theory.md, section 18).
module driven_signal
   use certified_search, only: bound_curvature, bound_jerk, bound_value, local_t, term_columns, term_curvature, &
      term_rate, term_value, viewed_signal_t
   use driven_modes, only: bound_driven_mode, driven_mode_at, driven_mode_t
   use kinds, only: wp
   use modal_signal, only: modal_signal_t
   implicit none (type, external)
   private
   public :: driven_signal_t, driven_terms_t

   !> constant + slope t + Re sum harmonic exp(i frequency t), and modes driven from rest.
   type :: driven_terms_t
      real(wp) :: constant = 0.0_wp
      real(wp) :: slope = 0.0_wp
      complex(wp), allocatable :: harmonic(:)
      real(wp), allocatable :: frequency(:)
      !> And their shares of the signal, of themselves and of their rates
      type(driven_mode_t), allocatable :: mode(:)
      real(wp), allocatable :: share(:), share_of_rate(:)
   end type driven_terms_t

   type, extends(viewed_signal_t) :: driven_signal_t
      class(viewed_signal_t), allocatable :: free
      !> What is added to it: its own `factor` times a derivative of the terms, from an instant of theirs on
      type(driven_terms_t) :: terms
      real(wp) :: factor = 1.0_wp
      real(wp) :: from = 0.0_wp
      integer :: order = 0
      !> No bound is asked for beyond that instant
      real(wp) :: until = huge(1.0_wp)
   contains
      procedure :: look
      procedure :: evaluate
      procedure :: view
   end type driven_signal_t

contains

   !> The signal and its slope at an instant.
   subroutine evaluate(self, t, value, slope)
      class(driven_signal_t), intent(in) :: self
      !> Instant
      real(wp), intent(in) :: t
      !> s and s'
      real(wp), intent(out) :: value
      real(wp), intent(out) :: slope

      real(wp) :: added, added_slope

      call self%free%evaluate(t, value, slope)
      call terms_at(self, t, added, added_slope)
      value = value + added
      slope = slope + added_slope
   end subroutine evaluate

   !> Value, slope and bounds of a derivative of the signal at an instant.
   subroutine look(self, t, order, here)
      class(driven_signal_t), intent(in) :: self
      !> Instant
      real(wp), intent(in) :: t
      !> Which derivative, 0: the signal itself
      integer, intent(in) :: order
      !> What is there
      type(local_t), intent(out) :: here

      real(wp) :: rows(size(self%terms%frequency) + size(self%terms%mode), term_columns)
      real(wp) :: rest(0:1), magnitude, rounding, known, slope

      call find_rows(self, t, order, rows, magnitude)
      rest = rest_of(self, t, order)
      select type (free => self%free)
      type is (modal_signal_t)
         call free%look_among(t, order, here, rows, rest)
      class default
         call free%look(t, order, here)
         ! its own steps know nothing of the rest
         here%free = 0.0_wp
      end select
      here%value = here%value + rest(0) + sum(rows(:, term_value))
      here%slope = here%slope + rest(1) + sum(rows(:, term_rate))
      here%curvature = here%curvature + sum(rows(:, term_curvature))
      here%bound = here%bound + sum(rows(:, bound_curvature))
      here%bound_both = here%bound_both + sum(rows(:, bound_curvature))
      here%bound_jerk = min(here%bound_jerk, 0.5_wp*huge(1.0_wp)) + sum(rows(:, bound_jerk))
      rounding = 4.0_wp*epsilon(1.0_wp)*(1.0_wp + highest_frequency(self)*(self%from + t))
      here%rounding = here%rounding + rounding*(abs(rest(0)) + magnitude)
      if (order == 0) then
         here%floor = here%floor + min(rest(0), rest(0) + rest(1)*max(self%until - t, 0.0_wp)) &
            - sum(rows(:, bound_value))
         here%signal = here%value
         here%signal_rounding = here%rounding
      else
         call terms_at(self, t, known, slope)
         here%signal = here%signal + known
         here%signal_rounding = here%signal_rounding + rounding*(abs(known) + abs(self%factor) &
            *sum(abs(self%terms%harmonic)*self%terms%frequency**self%order))
      end if
   end subroutine look

   !> offset + factor times a derivative of the signal, from an instant on.
   subroutine view(self, from, factor, offset, order, part)
      class(driven_signal_t), intent(in) :: self
      !> The instant
      real(wp), intent(in) :: from
      real(wp), intent(in) :: factor
      real(wp), intent(in) :: offset
      !> 0: the signal itself, 1: its slope
      integer, intent(in) :: order
      !> The same as a signal
      class(viewed_signal_t), allocatable, intent(out) :: part

      type(driven_signal_t), allocatable :: driven

      allocate (driven)
      call self%free%view(from, factor, offset, order, driven%free)
      driven%terms = self%terms
      driven%factor = factor*self%factor
      driven%from = self%from + from
      driven%order = self%order + order
      driven%until = self%until - from
      call move_alloc(driven, part)
   end subroutine view

   !> What is added, and its slope.
   subroutine terms_at(self, t, value, slope)
      class(driven_signal_t), intent(in) :: self
      real(wp), intent(in) :: t
      real(wp), intent(out) :: value
      real(wp), intent(out) :: slope

      real(wp) :: rest(0:1), rows(size(self%terms%frequency) + size(self%terms%mode), term_columns), magnitude

      call find_rows(self, t, 0, rows, magnitude)
      rest = rest_of(self, t, 0)
      value = rest(0) + sum(rows(:, term_value))
      slope = rest(1) + sum(rows(:, term_rate))
   end subroutine terms_at

   !> The constant and the slope: a derivative of what is added, and the next.
   pure function rest_of(self, t, order) result(rest)
      class(driven_signal_t), intent(in) :: self
      real(wp), intent(in) :: t
      integer, intent(in) :: order
      real(wp) :: rest(0:1)

      rest = 0.0_wp
      associate (terms => self%terms)
         if (self%order + order == 0) rest = self%factor*[terms%constant + terms%slope*(self%from + t), terms%slope]
         if (self%order + order == 1) rest(0) = self%factor*terms%slope
      end associate
   end function rest_of

   !> A derivative of each harmonic and of each mode driven from rest, those after it, and bounds on them from now on.
   subroutine find_rows(self, t, order, rows, magnitude)
      class(driven_signal_t), intent(in) :: self
      real(wp), intent(in) :: t
      integer, intent(in) :: order
      !> Columns as in `certified_search`
      real(wp), intent(out) :: rows(:, :)
      !> What the rounding error of that derivative is measured by
      real(wp), intent(out) :: magnitude

      integer, parameter :: value_columns(3) = [term_value, term_rate, term_curvature]
      complex(wp) :: term
      real(wp), allocatable :: here(:), bounds(:)
      real(wp) :: swing, time
      integer :: first, i, k, row

      first = order + self%order
      time = self%from + t
      do i = 1, size(self%terms%frequency)
         associate (w => self%terms%frequency(i))
            term = self%factor*self%terms%harmonic(i)*cmplx(cos(w*time), sin(w*time), wp)*cmplx(0.0_wp, w, wp)**first
            swing = abs(self%factor*self%terms%harmonic(i))*w**first
            rows(i, value_columns) = [real(term, wp), -w*aimag(term), -w**2*real(term, wp)]
            rows(i, bound_value) = swing
            rows(i, bound_curvature) = swing*w**2
            rows(i, bound_jerk) = swing*w**3
         end associate
      end do
      magnitude = sum(rows(:size(self%terms%frequency), bound_value))
      if (size(self%terms%mode) == 0) return
      allocate (here(0:first + 3), bounds(0:first + 4))
      do i = 1, size(self%terms%mode)
         row = size(self%terms%frequency) + i
         associate (share => self%factor*self%terms%share(i), of_rate => self%factor*self%terms%share_of_rate(i), &
            mode => self%terms%mode(i))
            here(:) = driven_mode_at(mode, time, first + 3)
            rows(row, value_columns) = [(share*here(first + k) + of_rate*here(first + k + 1), k=0, 2)]
            call bound_driven_mode(mode, time, bounds)
            magnitude = magnitude + abs(share)*bounds(first) + abs(of_rate)*bounds(first + 1)
            call bound_driven_mode(mode, self%from + self%until, bounds)
            rows(row, [bound_value, bound_curvature, bound_jerk]) = &
               [(abs(share)*bounds(first + k) + abs(of_rate)*bounds(first + k + 1), k=0, 0), &
               (abs(share)*bounds(first + k) + abs(of_rate)*bounds(first + k + 1), k=2, 3)]
         end associate
      end do
   end subroutine find_rows

   pure function highest_frequency(self) result(frequency)
      class(driven_signal_t), intent(in) :: self
      real(wp) :: frequency

      frequency = 0.0_wp
      if (size(self%terms%frequency) > 0) frequency = maxval(self%terms%frequency)
   end function highest_frequency

end module driven_signal
