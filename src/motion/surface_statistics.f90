!> What a phase among several surfaces adds to the statistics of a run: integrals of forces and displacements and of
!> their
!> squares, block by block (docs/theory.md, section 20).
module surface_statistics
   use beam_element, only: gauss_rule
   use block_statistics, only: take_contact
   use certified_search, only: viewed_signal_t
   use kinds, only: wp
   use phase_drives, only: drive_at
   use several_state, only: end_force, force_terms, several_t, signal_of, whole_gap, whole_tip
   use signal_integrals, only: find_swing, integrate_panel, integrate_signals, panel_points, panel_width, signals_t, &
      swing_t
   use signal_peaks, only: greatest_value
   use statistic_types, only: block_sums_t, low_displacement, low_tip, sum_displacement, sum_square_displacement, &
      sum_square_tip, sum_tip, top_displacement, top_tip
   implicit none (type, external)
   private
   public :: take_phase

contains

   !> A phase, which is cut where a block ends.
   subroutine take_phase(self, tau, length, blocks)
      type(several_t), intent(in) :: self
      !> Its start
      real(wp), intent(in) :: tau
      real(wp), intent(in) :: length
      type(block_sums_t), intent(inout) :: blocks

      type(signals_t) :: signals
      real(wp) :: from, to
      integer :: block, k, last

      last = ubound(blocks%edge, 1)
      if (.not. length > 0.0_wp) return
      if (tau < blocks%edge(last) .and. tau + length > blocks%edge(0)) then
         call find_signals(self, length, signals)
         do block = max(count(blocks%edge <= tau), 1), last
            from = max(blocks%edge(block - 1) - tau, 0.0_wp)
            to = min(blocks%edge(block) - tau, length)
            if (to > from) call take_stretch(self, signals, tau, from, to, block, blocks)
            if (blocks%edge(block) >= tau + length) exit
         end do
      end if
      do k = 1, size(self%states)
         ! contact lasts, and no impact begins, whatever counts of it
         if (self%set%is_closed(k)) call take_contact(blocks%surface(self%states(k)%surface%number), tau, tau &
            + length, blocks%rest, 0, [0.0_wp, 0.0_wp], 0.0_wp)
      end do
   end subroutine take_phase

   !> The part of a phase within one block.
   subroutine take_stretch(self, signals, tau, from, to, block, blocks)
      type(several_t), intent(in) :: self
      !> Displacements of surfaces and tip, forces of those that are closed
      type(signals_t), intent(in) :: signals
      !> Start of the phase
      real(wp), intent(in) :: tau
      !> Of the stretch, since that
      real(wp), intent(in) :: from
      real(wp), intent(in) :: to
      integer, intent(in) :: block
      type(block_sums_t), intent(inout) :: blocks

      real(wp), dimension(size(signals%offset)) :: first, second
      class(viewed_signal_t), allocatable :: signal
      real(wp) :: greatest
      integer :: k, n

      n = size(self%states)
      if (has_driven_modes(self)) then
         call integrate_panels(self, signals, from, to, first, second)
      else
         call integrate_signals(signals, from, to, first, second)
      end if
      associate (sums => blocks%tip%sums(:, block))
         sums([sum_tip, sum_square_tip]) = sums([sum_tip, sum_square_tip]) + [first(n + 1), second(n + 1)]
         call signal_of(self, 0, whole_tip, signal)
         call extend(signal, from, to, 1.0_wp, 0.0_wp, sums(low_tip:top_tip))
      end associate
      do k = 1, n
         associate (state => self%states(k), surface => blocks%surface(self%states(k)%surface%number))
            associate (sums => surface%sums(:, block), sign => state%surface%sign)
               sums([sum_displacement, sum_square_displacement]) = sums([sum_displacement, sum_square_displacement]) &
                  + [sign*first(k), second(k)]
               if (self%set%is_closed(k) .and. state%is_rigid) then
                  sums(low_displacement) = min(sums(low_displacement), sign*state%surface%height)
                  sums(top_displacement) = max(sums(top_displacement), sign*state%surface%height)
               else
                  call signal_of(self, k, whole_gap, signal)
                  call extend(signal, from, to, sign, sign*self%beam%height(k), &
                     sums(low_displacement:top_displacement))
               end if
            end associate
            if (.not. self%set%is_closed(k)) cycle
            greatest = 0.0_wp
            if (.not. state%is_rigid) then
               call signal_of(self, k, end_force, signal)
               call raise(signal, from, to, 1.0_wp, greatest)
            end if
            call take_contact(surface, tau + from, tau + to, blocks%rest, block, [first(n + 1 + k), second(n + 1 &
               + k)], greatest)
         end associate
      end do
   end subroutine take_stretch

   !> Widen the range of what goes as sign times a signal and a constant.
   subroutine extend(signal, from, to, sign, constant, range)
      class(viewed_signal_t), intent(in) :: signal
      real(wp), intent(in) :: from
      real(wp), intent(in) :: to
      real(wp), intent(in) :: sign
      real(wp), intent(in) :: constant
      real(wp), intent(inout) :: range(2)

      real(wp) :: greatest, least

      greatest = range(2) - constant
      least = constant - range(1)
      call raise(signal, from, to, sign, greatest)
      call raise(signal, from, to, -sign, least)
      range = [constant - least, constant + greatest]
   end subroutine extend

   !> The greatest value of a signal times a factor, if it is greater than what is known.
   subroutine raise(signal, from, to, factor, greatest)
      class(viewed_signal_t), intent(in) :: signal
      real(wp), intent(in) :: from
      real(wp), intent(in) :: to
      real(wp), intent(in) :: factor
      real(wp), intent(inout) :: greatest

      class(viewed_signal_t), allocatable :: part
      real(wp) :: slope, time, value
      logical :: is_greater, still_rises

      call signal%view(from, factor, 0.0_wp, 0, part)
      ! its end first: mostly that spares a search, which would find it too
      call part%evaluate(to - from, value, slope)
      greatest = max(greatest, value)
      call greatest_value(part, to - from, greatest, is_greater, still_rises, value, time)
      if (is_greater) greatest = value
   end subroutine raise

   !> Are there modes that loads drive from rest, which are no sums of terms?
   pure function has_driven_modes(self) result(has)
      type(several_t), intent(in) :: self
      logical :: has

      has = .false.
      if (self%loads%count > 0) has = size(self%drive%pair) > 0
   end function has_driven_modes

   !> Displacements of all surfaces away from them and of the tip up, and forces of the surfaces: what swings of itself
   !> and, but where modes are driven from rest, what loads do.
   subroutine find_signals(self, length, signals)
      type(several_t), intent(in) :: self
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
      if (self%loads%count > 0 .and. .not. has_driven_modes(self)) call add_drives(self, signals)
   end subroutine find_signals

   !> What swings on surfaces that yield.
   subroutine add_terms(self, signals)
      type(several_t), intent(in) :: self
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
            call force_terms(self, k, signals%offset(n + 1 + k), amplitude)
            signals%amplitude(n + 1 + k, :) = amplitude
         end do
      end associate
   end subroutine add_terms

   !> Modes that swing alone. Of one with the exponent s a reaction has 1 + 2 zeta s = -s (s + alpha)/W^2.
   subroutine add_swings(self, length, modes, signals)
      type(several_t), intent(in) :: self
      real(wp), intent(in) :: length
      integer, intent(in) :: modes(:)
      type(signals_t), intent(inout) :: signals

      type(swing_t) :: swings(size(modes))
      complex(wp), allocatable :: amplitude(:, :), exponent(:)
      complex(wp) :: viscous
      integer :: i, j, k, n, place, term

      n = size(self%states)
      associate (set => self%set, held => self%set%held, oscillators => self%set%held%oscillators)
         do j = 1, size(modes)
            i = modes(j)
            call find_swing(oscillators%decay(i), oscillators%spread(i), i <= oscillators%oscillating, &
               [self%z(i), self%v(i)], length, swings(j))
         end do
         term = size(signals%exponent)
         allocate (exponent(term + sum([(size(swings(j)%exponent), j=1, size(modes))])))
         allocate (amplitude(2*n + 1, size(exponent)), source=(0.0_wp, 0.0_wp))
         exponent(:term) = signals%exponent
         amplitude(:, :term) = signals%amplitude
         do j = 1, size(modes)
            i = modes(j)
            do k = 1, size(swings(j)%exponent)
               term = term + 1
               associate (s => swings(j)%exponent(k), c => swings(j)%amplitude(k))
                  exponent(term) = s
                  amplitude(:n, term) = c*held%value(modes(j), :)
                  amplitude(n + 1, term) = c*held%tip_value(modes(j))
                  if (size(set%pressed) > 0) cycle
                  viscous = 1.0_wp + oscillators%two_zeta*s
                  if (.not. swings(j)%is_circle .and. oscillators%frequency(i) >= oscillators%mass_rate(i)) then
                     viscous = -s*(s + oscillators%mass_rate(i))/oscillators%square(i)
                  end if
                  do place = 1, size(held%held)
                     amplitude(n + 1 + held%held(place), term) = c*viscous*held%reaction(place, modes(j))
                  end do
               end associate
            end do
         end do
         if (size(set%pressed) == 0) signals%offset(n + 1 + held%held) = held%static_force
      end associate
      call move_alloc(exponent, signals%exponent)
      call move_alloc(amplitude, signals%amplitude)
   end subroutine add_swings

   !> What loads do, where no mode is driven from rest.
   subroutine add_drives(self, signals)
      type(several_t), intent(in) :: self
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
      type(several_t), intent(in) :: self
      integer, allocatable :: rows(:)

      integer :: k

      associate (at => self%set%drive%at, n => size(self%states))
         rows = [(at%gaps + k, k=1, n), at%tip + 1, (at%forces + k, k=1, n)]
      end associate
   end function rows_of

   !> By a Gauss rule, on panels within which nothing turns far: exact to rounding.
   subroutine integrate_panels(self, signals, from, to, first, second)
      type(several_t), intent(in) :: self
      !> What swings of itself
      type(signals_t), intent(in) :: signals
      real(wp), intent(in) :: from
      real(wp), intent(in) :: to
      real(wp), intent(out) :: first(:)
      real(wp), intent(out) :: second(:)

      real(wp), allocatable :: point(:), weight(:)
      real(wp) :: besides(size(first), panel_points), rows(self%set%drive%at%rows), start, width
      integer :: j

      call gauss_rule(panel_points, point, weight)
      first = 0.0_wp
      second = 0.0_wp
      start = from
      do while (start < to)
         width = panel_width(signals, start, maxval([0.0_wp, self%drive%frequency]))
         ! what is left in two parts rather than one that is next to nothing
         if (start + width >= to) then
            width = to - start
         else if (start + 2.0_wp*width > to) then
            width = 0.5_wp*(to - start)
         end if
         do j = 1, panel_points
            rows = drive_at(self%set%drive, self%drive, 1, size(rows), start + width*point(j), 0)
            besides(:, j) = rows(rows_of(self))
         end do
         call integrate_panel(signals, start + width*point, width*weight, besides, first, second)
         if (start + width >= to) exit
         start = start + width
      end do
   end subroutine integrate_panels

end module surface_statistics
