!> What a phase among several surfaces adds to the statistics of a run: integrals of forces and displacements and of
!> their squares, block by block (docs/theory.md, section 20).
module surface_statistics
   use block_statistics, only: blocks_begun, take_contact, take_flight, width_of_blocks
   use certified_search, only: search_t, viewed_signal_t
   use driven_modes, only: driven_mode_t
   use kinds, only: wp
   use mode_terms, only: find_mode_terms, mode_terms_t, slow_exponents, slow_points
   use phase_state, only: end_force, force_terms, phase_state_t, signal_of, whole_gap, whole_tip
   use signal_integrals, only: are_squares_of, integrate_signals, make_squares, signals_t
   use signal_peaks, only: exceeds, greatest_value, looks_t
   use statistic_types, only: block_sums_t, low_displacement, low_tip, sum_displacement, sum_square_displacement, &
      sum_square_tip, sum_tip, surface_sums_t, top_displacement, top_force, top_tip
   implicit none (type, external)
   private
   public :: take_phase

contains

   !> A phase, which is cut where a block ends.
   subroutine take_phase(self, searches, tau, length, blocks)
      type(phase_state_t), intent(in) :: self
      !> For its end at each surface, [surfaces]
      type(search_t), intent(in) :: searches(:)
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
         call prepare_squares(signals, tau, length, blocks)
         do block = max(blocks_begun(blocks, tau), 1), last
            from = max(blocks%edge(block - 1) - tau, 0.0_wp)
            to = min(blocks%edge(block) - tau, length)
            if (to > from) call take_stretch(self, signals, tau, from, to, block, blocks)
            if (blocks%edge(block) >= tau + length) exit
         end do
      end if
      do k = 1, size(self%states)
         associate (surface => blocks%surface(self%states(k)%surface%number))
            if (self%set%is_closed(k)) then
               ! contact lasts, and no impact begins, whatever counts of it
               call take_contact(surface, tau, tau + length, 0, [0.0_wp, 0.0_wp], 0.0_wp)
            else if (.not. surface%has_flown .and. self%states(k)%acts) then
               call watch_flight(self, k, searches(k), length, blocks%hop_tolerance, surface)
            end if
         end associate
      end do
   end subroutine take_phase

   !> Does the beam rise above the hop tolerance over a surface that it has left?
   subroutine watch_flight(self, k, seen, length, hop_tolerance, surface)
      type(phase_state_t), intent(in) :: self
      integer, intent(in) :: k
      !> Of its gap
      type(search_t), intent(in) :: seen
      !> Of the phase
      real(wp), intent(in) :: length
      real(wp), intent(in) :: hop_tolerance
      type(surface_sums_t), intent(inout) :: surface

      class(viewed_signal_t), allocatable :: signal
      real(wp) :: level, slope, value

      if (self%states(k)%is_rigid .and. seen%ceiling <= hop_tolerance) return
      associate (held => self%set%held)
         level = hop_tolerance + 4.0_wp*epsilon(1.0_wp)*(abs(held%static_gap(k)) + sum(abs(held%value(:, k)*self%z)))
      end associate
      call signal_of(self, k, whole_gap, signal)
      ! mostly its end spares a search
      call signal%evaluate(length, value, slope)
      if (value <= level) then
         if (exceeds(signal, length, level)) value = huge(value)
      end if
      call take_flight(surface, value, level)
   end subroutine watch_flight

   !> Where a phase spans many blocks, the squares of its terms within one are worth making.
   subroutine prepare_squares(signals, tau, length, blocks)
      type(signals_t), intent(in) :: signals
      !> Start of the phase, and its length
      real(wp), intent(in) :: tau
      real(wp), intent(in) :: length
      type(block_sums_t), intent(inout) :: blocks

      ! they cost about as much as all pairs of terms in so many blocks
      integer, parameter :: worth = 4
      real(wp) :: width

      if (blocks_begun(blocks, tau + length) - blocks_begun(blocks, tau) - 1 < worth) return
      width = width_of_blocks(blocks)
      if (are_squares_of(blocks%squares, signals%exponent, width)) return
      call make_squares(signals%exponent, width, blocks%squares)
   end subroutine prepare_squares

   !> The part of a phase within one block.
   subroutine take_stretch(self, signals, tau, from, to, block, blocks)
      type(phase_state_t), intent(in) :: self
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
      class(viewed_signal_t), allocatable :: part, signal
      real(wp) :: force(2)
      integer :: k, n

      n = size(self%states)
      if (is_whole()) then
         call integrate_signals(signals, from, to, first, second, blocks%squares)
      else
         call integrate_signals(signals, from, to, first, second)
      end if
      associate (sums => blocks%tip%sums(:, block))
         sums([sum_tip, sum_square_tip]) = sums([sum_tip, sum_square_tip]) + [first(n + 1), second(n + 1)]
         call signal_of(self, 0, whole_tip, signal)
         call extend(signal, from, to, 1.0_wp, 0.0_wp, sums(low_tip:top_tip), blocks%looks(low_tip:top_tip))
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
                     sums(low_displacement:top_displacement), blocks%looks(low_displacement:top_displacement))
               end if
            end associate
            if (.not. self%set%is_closed(k)) cycle
            force = 0.0_wp
            if (.not. state%is_rigid) then
               call signal_of(self, k, end_force, signal)
               call signal%view(from, 1.0_wp, 0.0_wp, 0, part)
               call enter_end(part, 0.0_wp, force)
               call enter_end(part, to - from, force)
               call raise(part, to - from, maxval(force), force(2), blocks%looks(top_force))
            end if
            call take_contact(surface, tau + from, tau + to, block, [first(n + 1 + k), second(n + 1 + k)], force(2))
         end associate
      end do

   contains

      !> Are the squares at hand, and is it as long as they are but for rounding?
      pure function is_whole() result(is)
         logical :: is

         real(wp), parameter :: rounding = 1.0e-9_wp

         associate (width => width_of_blocks(blocks))
            is = abs(to - from - width) <= rounding*width
            if (is) is = are_squares_of(blocks%squares, signals%exponent, width)
         end associate
      end function is_whole
   end subroutine take_stretch

   !> Widen the range of what goes as sign times a signal and a constant.
   subroutine extend(signal, from, to, sign, constant, range, looks)
      class(viewed_signal_t), intent(in) :: signal
      real(wp), intent(in) :: from
      real(wp), intent(in) :: to
      real(wp), intent(in) :: sign
      real(wp), intent(in) :: constant
      real(wp), intent(inout) :: range(2)
      !> What the searches for both have left
      type(looks_t), intent(inout) :: looks(2)

      class(viewed_signal_t), allocatable :: part
      real(wp) :: least

      call signal%view(from, sign, constant, 0, part)
      call enter_end(part, 0.0_wp, range)
      call enter_end(part, to - from, range)
      call raise(part, to - from, maxval(abs(range)), range(2), looks(2))
      call signal%view(from, -sign, -constant, 0, part)
      least = -range(1)
      call raise(part, to - from, maxval(abs(range)), least, looks(1))
      range(1) = -least
   end subroutine extend

   !> Its ends first: mostly that spares a search, which would find them too.
   subroutine enter_end(signal, time, range)
      class(viewed_signal_t), intent(in) :: signal
      real(wp), intent(in) :: time
      real(wp), intent(inout) :: range(2)

      real(wp) :: slope, value

      call signal%evaluate(time, value, slope)
      range = [min(range(1), value), max(range(2), value)]
   end subroutine enter_end

   !> The greatest value of a signal, if it is greater than what is known.
   subroutine raise(signal, length, scale, greatest, looks)
      class(viewed_signal_t), intent(in) :: signal
      real(wp), intent(in) :: length
      !> By which its tolerance goes, too
      real(wp), intent(in) :: scale
      real(wp), intent(inout) :: greatest
      type(looks_t), intent(inout) :: looks

      real(wp) :: time, value
      logical :: is_greater, still_rises

      call greatest_value(signal, length, greatest, is_greater, still_rises, value, time, scale, looks)
      if (is_greater) greatest = value
   end subroutine raise

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
            call force_terms(self, k, signals%offset(n + 1 + k), amplitude)
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

end module surface_statistics
