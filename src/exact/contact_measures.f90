!> Measures of a run among several surfaces, each from its own flights and contacts, phase by phase.
module contact_measures
   use certified_search, only: first_zero, found_zero, search_t, viewed_signal_t
   use driven_modes, only: driven_mode_at, integral_of, integral_of_swing, make_driven_mode
   use joint_modes, only: terms_at
   use kinds, only: wp
   use motion_phases, only: motion_t
   use phase_measures, only: finish_measures, keep_loud, measure_force, measure_rise, measurer_t, seek_peak
   use phase_state, only: end_force, force_terms, move_alone, phase_state_t, signal_of, whole_gap
   use point_forces, only: slow
   use power_integrals, only: integral
   use response_types, only: quiet_level, response_t
   use run_measures, only: early_part, end_episode, gather_measures, take_contact
   use signal_peaks, only: exceeds
   use surface_states, only: of_rigid_stop
   implicit none (type, external)
   private
   public :: measure_surfaces, finish_surfaces

contains

   !> What a phase tells of each surface.
   subroutine measure_surfaces(self, length, searches, is_last, motion)
      type(phase_state_t), intent(inout) :: self
      real(wp), intent(in) :: length
      !> For the end of the phase at each, [surfaces]
      type(search_t), intent(in) :: searches(:)
      !> The run ends with it
      logical, intent(in) :: is_last
      !> `tau` is still that of the start
      type(motion_t), intent(inout) :: motion

      integer :: k

      do k = 1, size(self%states)
         if (.not. (self%states(k)%acts .or. k == self%pulled)) cycle
         if (k == self%pulled) then
            call measure_surface(self, k, length, searches(k), is_last, motion%tau, motion%measurer)
         else
            call measure_surface(self, k, length, searches(k), is_last, motion%tau, self%measurers(k))
         end if
      end do
   end subroutine measure_surfaces

   !> One of them.
   subroutine measure_surface(self, k, length, seen, is_last, tau, measurer)
      type(phase_state_t), intent(inout) :: self
      integer, intent(in) :: k
      real(wp), intent(in) :: length
      !> Of the gap, or the force
      type(search_t), intent(in) :: seen
      logical, intent(in) :: is_last
      !> Start of the phase
      real(wp), intent(in) :: tau
      type(measurer_t), intent(inout) :: measurer

      class(viewed_signal_t), allocatable :: signal
      real(wp) :: value, slope
      logical :: is_loud, rises

      if (self%set%is_closed(k)) then
         call measure_closed(self, k, length, seen%greatest, tau, measurer)
         self%states(k)%has_risen = .false.
         if (k /= self%pulled .or. of_rigid_stop(self%states(k))) return
         if (.not. may_sink(self, k)) return
         call signal_of(self, k, whole_gap, signal)
         if (sinks(signal, length)) call keep_for_quiet()
         return
      end if
      ! most hops are too low to be looked into again
      if (self%states(k)%is_rigid .and. seen%ceiling <= quiet_level .and. .not. self%states(k)%has_risen) return
      call signal_of(self, k, whole_gap, signal)
      ! its surface is where it is home
      associate (state => self%states(k))
         is_loud = .false.
         if (state%has_risen .and. .not. state%is_first_flight) then
            call measure_higher(measurer, signal, tau, length, is_last)
         else if (.not. state%has_risen) then
            if (state%is_first_flight) then
               rises = exceeds(signal, length, quiet_level)
            else if (self%trail_of == k) then
               call measure_rise(measurer, signal, tau, length, .false., is_last, min(seen%greatest, &
                  quiet_level), rises, self%trail)
            else
               call measure_rise(measurer, signal, tau, length, .false., is_last, min(seen%greatest, &
                  quiet_level), rises)
            end if
            state%has_risen = rises
            is_loud = rises
            if (rises) call end_episode(measurer%tally)
         end if
         if (k /= self%pulled) return
         if (.not. is_loud) then
            ! it may have been low from the start, or risen before
            call signal%evaluate(0.0_wp, value, slope)
            is_loud = abs(value) > quiet_level
         end if
         if (state%has_risen .and. .not. is_loud) is_loud = exceeds(signal, length, quiet_level)
      end associate
      if (is_loud) call keep_for_quiet()

   contains

      !> The signal, and with it the set to which it points.
      subroutine keep_for_quiet()
         call keep_loud(measurer, signal, tau, length)
         self%store%in_use => self%set
      end subroutine keep_for_quiet
   end subroutine measure_surface

   !> A flight that events of other surfaces cut goes on: does it rise above its highest point so far? If it still does
   !> as the run ends it was no rebound.
   subroutine measure_higher(measurer, signal, tau, length, is_last)
      type(measurer_t), intent(inout) :: measurer
      !> The gap of a surface, home
      class(viewed_signal_t), intent(in) :: signal
      !> Start and length of the phase
      real(wp), intent(in) :: tau
      real(wp), intent(in) :: length
      logical, intent(in) :: is_last

      real(wp) :: known, peak, time
      logical :: is_higher, still_rises

      associate (measures => measurer%measures)
         known = quiet_level
         if (measures%rebounds <= measurer%most_peaks) known = measures%peak_eta(measures%rebounds)
         if (measures%rebounds > measurer%most_peaks .and. .not. is_last) return
         call seek_peak(measurer%tally, signal, length, known, is_higher, still_rises, peak, time)
         if (.not. is_higher) return
         if (is_last .and. still_rises) then
            measures%rebounds = measures%rebounds - 1
         else if (measures%rebounds <= measurer%most_peaks) then
            measures%peak_eta(measures%rebounds) = peak
            measures%peak_tau(measures%rebounds) = tau + time
         end if
      end associate
   end subroutine measure_higher

   !> Force and impulse of a closed surface.
   subroutine measure_closed(self, k, length, greatest, tau, measurer)
      type(phase_state_t), intent(in) :: self
      integer, intent(in) :: k
      real(wp), intent(in) :: length
      real(wp), intent(in) :: greatest
      !> Start of the phase
      real(wp), intent(in) :: tau
      type(measurer_t), intent(inout) :: measurer

      class(viewed_signal_t), allocatable :: signal
      real(wp) :: early, early_impulse

      early = 0.0_wp
      early_impulse = 0.0_wp
      if (of_rigid_stop(self%states(k))) then
         early = early_part(measurer%tally, tau, length)
         if (early > 0.0_wp) early_impulse = impulse_until(self, k, early)
      else if (self%pressing_at == k) then
         call measure_force(measurer%tally, self%pressing, length, greatest)
      else
         call signal_of(self, k, end_force, signal)
         call measure_force(measurer%tally, signal, length, greatest)
      end if
      call take_contact(measurer%tally, tau, length, impulse_until(self, k, length), early_impulse)
   end subroutine measure_closed

   !> Integral of a force from the start of the phase.
   function impulse_until(self, k, time) result(impulse)
      type(phase_state_t), intent(in) :: self
      integer, intent(in) :: k
      real(wp), intent(in) :: time
      real(wp) :: impulse

      complex(wp), allocatable :: amplitude(:)
      real(wp), dimension(size(self%z)) :: z, v
      real(wp) :: offset, part
      integer :: i, place

      if (size(self%set%pressed) > 0) then
         call force_terms(self, k, offset, amplitude)
         associate (s => self%set%joint%exponent)
            impulse = offset*time + sum(real(amplitude*integral(s, time, terms_at(self%set%joint, &
               spread((1.0_wp, 0.0_wp), 1, size(s)), time)), wp))
         end associate
      else
         ! a mode's part, p + 2 zeta p', is -(p'' + alpha p')/w^2
         call move_alone(self, time, z, v)
         associate (held => self%set%held, square => self%set%held%oscillators%square)
            place = findloc(held%held, k, dim=1)
            impulse = held%static_force(place)*time
            do i = 1, size(z)
               if (square(i) < slow**2) then
                  part = integral_of_swing(make_driven_mode(held%oscillators, i), [self%z(i), self%v(i)], time) &
                     + held%oscillators%two_zeta*(z(i) - self%z(i))
               else
                  part = (self%v(i) - v(i) + held%oscillators%mass_rate(i)*(self%z(i) - z(i)))/square(i)
               end if
               impulse = impulse + held%reaction(place, i)*part
            end do
         end associate
      end if
      if (self%loads%count > 0) impulse = impulse + impulse_of_terms(self, k, time)
   end function impulse_until

   !> What loads add to it.
   function impulse_of_terms(self, k, time) result(impulse)
      type(phase_state_t), intent(in) :: self
      integer, intent(in) :: k
      real(wp), intent(in) :: time
      real(wp) :: impulse

      real(wp) :: here(0:1)
      integer :: i, row

      associate (set => self%set%drive, drive => self%drive)
         row = set%at%forces + k
         impulse = (drive%constant(row) + 0.5_wp*drive%slope(row)*time)*time
         do i = 1, size(drive%frequency)
            associate (s => cmplx(0.0_wp, drive%frequency(i), wp))
               impulse = impulse + real(drive%harmonic(row, i)*integral(s, time, exp(s*time)), wp)
            end associate
         end do
         do i = 1, size(drive%pair)
            here = driven_mode_at(drive%mode(i), time, 1)
            associate (pair => set%driven(drive%pair(i)))
               impulse = impulse + pair%row_of_rate(row)*here(0) + pair%row(row)*integral_of(drive%mode(i), time)
            end associate
         end do
      end associate
   end function impulse_of_terms

   !> Could the point of a surface that is pressed sink below the quiet level? Terms only grow less.
   pure function may_sink(self, k) result(may)
      type(phase_state_t), intent(in) :: self
      integer, intent(in) :: k
      logical :: may

      real(wp) :: depth

      associate (term => self%set%gap(k, :)*self%amplitude)
         depth = sum(sqrt(real(term, wp)**2 + aimag(term)**2)) - self%set%rest_gap(k)
      end associate
      may = .false.
      if (self%loads%count > 0) then
         associate (row => self%set%drive%at%gaps + k, drive => self%drive)
            depth = depth - drive%constant(row) + sum(abs(drive%harmonic(row, :)))
            may = abs(drive%slope(row)) > 0.0_wp .or. size(drive%pair) > 0
         end associate
      end if
      may = may .or. depth > quiet_level
   end function may_sink

   !> Does the stop point sink below the quiet level?
   function sinks(gap, length) result(does)
      class(viewed_signal_t), intent(in) :: gap
      real(wp), intent(in) :: length
      logical :: does

      class(viewed_signal_t), allocatable :: above
      type(search_t) :: search
      real(wp) :: value, slope

      call gap%evaluate(0.0_wp, value, slope)
      does = value < -quiet_level
      if (does) return
      call gap%view(0.0_wp, 1.0_wp, quiet_level, 0, above)
      call first_zero(above, length, search)
      does = search%outcome == found_zero
   end function sinks

   !> The end of the run: measures of each surface, and of all.
   subroutine finish_surfaces(self, duration, motion, response)
      type(phase_state_t), intent(inout) :: self
      real(wp), intent(in) :: duration
      type(motion_t), intent(inout) :: motion
      !> Its surfaces are there; it gets the measures
      type(response_t), intent(inout) :: response

      integer :: k

      motion%measurer%lost_stop = sum(self%states%dissipated)
      if (size(self%states) == 0) then
         call finish_measures(motion%measurer, duration, motion%recorder%ledger, response)
         return
      end if
      do k = 1, size(self%states)
         associate (number => self%states(k)%surface%number)
            if (k == self%pulled) then
               call finish_measures(motion%measurer, duration, motion%recorder%ledger, response, number)
            else
               self%measurers(k)%measures%final_energy = motion%measurer%measures%final_energy
               call finish_measures(self%measurers(k), duration, motion%recorder%ledger, response, number)
            end if
            call move_alloc(response%measures, response%surfaces(number)%measures)
         end associate
      end do
      call gather_measures(response, self%states(self%pulled)%surface%number)
   end subroutine finish_surfaces

end module contact_measures
