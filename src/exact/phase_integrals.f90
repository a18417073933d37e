!> Integrals of displacements and forces and of their squares over stretches of a phase, in closed form (docs/theory.md,
!> section 20).
module phase_integrals
   use driven_modes, only: driven_mode_t
   use kinds, only: wp
   use mode_terms, only: find_mode_terms, mode_terms_t, slow_exponents, slow_points
   use phase_state, only: force_terms, phase_state_t
   use signal_integrals, only: are_squares_of, integrate_signals, make_squares, signals_t, squares_t
   implicit none (type, external)
   private
   public :: find_signals, integrate_stretch

contains

   !> A stretch of a phase.
   subroutine integrate_stretch(signals, stretch, pieces, piece_length, squares, first, second)
      !> From `find_signals`
      type(signals_t), intent(in) :: signals
      !> Its ends, since the start of the phase
      real(wp), intent(in) :: stretch(2)
      !> So many stretches of one length are asked for, and that
      integer, intent(in) :: pieces
      real(wp), intent(in) :: piece_length
      !> What terms make of their squares within such a stretch: kept from phase to phase
      type(squares_t), intent(inout) :: squares
      !> Of displacements, the tip's and forces, and of their squares, [signals]
      real(wp), intent(out) :: first(:)
      real(wp), intent(out) :: second(:)

      ! squares cost about as much as all pairs of terms in so many stretches
      integer, parameter :: worth = 4
      real(wp), parameter :: rounding = 1.0e-9_wp
      logical :: are_ready

      are_ready = .false.
      if (abs(stretch(2) - stretch(1) - piece_length) <= rounding*piece_length) then
         are_ready = are_squares_of(squares, signals%exponent, piece_length)
         if (pieces >= worth .and. .not. are_ready) call make_squares(signals%exponent, piece_length, squares)
         are_ready = are_ready .or. pieces >= worth
      end if
      if (are_ready) then
         call integrate_signals(signals, stretch(1), stretch(2), first, second, squares)
      else
         call integrate_signals(signals, stretch(1), stretch(2), first, second)
      end if
   end subroutine integrate_stretch

   !> Displacements of all surfaces away from them and of the tip up, and forces of the surfaces.
   subroutine find_signals(self, length, signals)
      type(phase_state_t), intent(in) :: self
      !> Of the phase
      real(wp), intent(in) :: length
      type(signals_t), intent(out) :: signals

      integer :: n

      n = size(self%states)
      allocate (signals%offset(2*n + 1), signals%slope(2*n + 1), source=0.0_wp)
      allocate (signals%exponent(0), signals%amplitude(2*n + 1, 0))
      signals%offset(:n) = self%set%held%static_gap + self%beam%height
      signals%offset(n + 1) = self%set%held%static_tip
      if (size(self%set%pressed) > 0) then
         call add_terms(self, signals)
         call add_swings(self, length, self%set%joint%inactive, signals)
      else
         call add_swings(self, length, [(n, n=1, self%set%held%count)], signals)
      end if
      if (self%loads%count > 0) call add_drives(self, signals)
   end subroutine find_signals

   !> What swings on surfaces that yield.
   subroutine add_terms(self, signals)
      type(phase_state_t), intent(in) :: self
      type(signals_t), intent(inout) :: signals

      complex(wp), allocatable :: amplitude(:)
      integer :: k, n

      n = size(self%states)
      associate (set => self%set)
         signals%exponent = set%joint%exponent
         deallocate (signals%amplitude)
         allocate (signals%amplitude(2*n + 1, size(signals%exponent)), source=(0.0_wp, 0.0_wp))
         signals%offset(:n) = set%rest_gap + self%beam%height
         do k = 0, n
            if (k > 0) then
               signals%amplitude(k, :) = set%gap(k, :)*self%amplitude
               if (.not. set%is_closed(k)) cycle
            end if
            call force_terms(self, k, self%amplitude, signals%offset(n + 1 + k), amplitude)
            signals%amplitude(n + 1 + k, :) = amplitude
         end do
      end associate
   end subroutine add_terms

   !> Modes that swing alone, of themselves and as loads drive them from rest.
   subroutine add_swings(self, length, modes, signals)
      type(phase_state_t), intent(in) :: self
      real(wp), intent(in) :: length
      integer, intent(in) :: modes(:)
      type(signals_t), intent(inout) :: signals

      type(mode_terms_t) :: terms(size(modes))
      complex(wp), allocatable :: amplitude(:, :), exponent(:)
      ! a mode in the signals: by itself, and with 2 zeta times its rate
      real(wp) :: share(size(signals%offset), 2)
      integer :: j, last, n, shared

      n = size(self%states)
      do j = 1, size(modes)
         call find_mode_terms(self%set%held%oscillators, modes(j), [self%z(modes(j)), self%v(modes(j))], &
            drives_of(self, modes(j)), length, terms(j))
      end do
      last = size(signals%exponent)
      shared = 0
      if (any([(any(abs(terms(j)%slow) > 0.0_wp), j=1, size(modes))])) shared = slow_points
      allocate (exponent, source=[signals%exponent, slow_exponents(length, shared), &
         (terms(j)%exponent, j=1, size(modes))])
      allocate (amplitude(2*n + 1, size(exponent)), source=(0.0_wp, 0.0_wp))
      amplitude(:, :last) = signals%amplitude
      associate (held => self%set%held, slow => amplitude(:, last + 1:last + shared))
         last = last + shared
         share = 0.0_wp
         do j = 1, size(modes)
            share(:n, 1) = held%value(modes(j), :)
            share(n + 1, 1) = held%tip_value(modes(j))
            if (size(self%set%pressed) == 0) share(n + 1 + held%held, 2) = held%reaction(:, modes(j))
            signals%offset = signals%offset + matmul(share, terms(j)%offset)
            signals%slope = signals%slope + matmul(share, terms(j)%slope)
            slow = slow + matmul(share, terms(j)%slow(:, :shared))
            associate (own => size(terms(j)%exponent))
               amplitude(:, last + 1:last + own) = matmul(share, terms(j)%amplitude)
               last = last + own
            end associate
         end do
         if (size(self%set%pressed) == 0) signals%offset(n + 1 + held%held) = signals%offset(n + 1 + held%held) &
            + held%static_force
      end associate
      call move_alloc(exponent, signals%exponent)
      call move_alloc(amplitude, signals%amplitude)
   end subroutine add_swings

   !> What drives a mode from rest.
   pure function drives_of(self, mode) result(drives)
      type(phase_state_t), intent(in) :: self
      integer, intent(in) :: mode
      type(driven_mode_t), allocatable :: drives(:)

      integer :: k

      allocate (drives(0))
      if (self%loads%count == 0) return
      associate (driven => self%set%drive%driven, drive => self%drive)
         drives = pack(drive%mode, [(driven(drive%pair(k))%mode == mode, k=1, size(drive%pair))])
      end associate
   end function drives_of

   !> What loads do but for the modes that they drive from rest.
   subroutine add_drives(self, signals)
      type(phase_state_t), intent(in) :: self
      type(signals_t), intent(inout) :: signals

      complex(wp), allocatable :: amplitude(:, :)
      integer, allocatable :: rows(:)
      integer :: terms

      allocate (rows, source=rows_of(self))
      terms = size(signals%exponent)
      associate (drive => self%drive)
         signals%offset = signals%offset + drive%constant(rows)
         signals%slope = signals%slope + drive%slope(rows)
         allocate (amplitude(size(rows), terms + size(drive%frequency)))
         amplitude(:, :terms) = signals%amplitude
         amplitude(:, terms + 1:) = drive%harmonic(rows, :)
         signals%exponent = [signals%exponent, cmplx(0.0_wp, drive%frequency, wp)]
      end associate
      call move_alloc(amplitude, signals%amplitude)
   end subroutine add_drives

   !> Their rows in the answers to loads.
   pure function rows_of(self) result(rows)
      type(phase_state_t), intent(in) :: self
      integer, allocatable :: rows(:)

      integer :: k

      associate (at => self%set%drive%at, n => size(self%states))
         rows = [(at%gaps + k, k=1, n), at%tip + 1, (at%forces + k, k=1, n)]
      end associate
   end function rows_of

end module phase_integrals
