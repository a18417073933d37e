!> Surrogate harmonics for loads on a beam with closed compliant contacts, if a term exp(s t) of the motion is slow,
!> that is, hardly changes during the run or a segment of a table. The static response of such a term to a load would be
!> much larger than the motion. A sum of harmonics with frequencies of about the inverse length of the phase therefore
!> replaces constant, linear and slow harmonic loads during a phase; the responses to these surrogates are hardly larger
!> than the motion (docs/theory.md, section 18). They also replace a harmonic load in resonance with a term, whose
!> steady-state response would be as large.
module surrogate_loads
   use applied_loads, only: applied_loads_t, largest_slope, largest_value
   use compliant_stop, only: dynamic_stiffness_t
   use constrained_sets, only: constrained_set_t
   use coupled_modes, only: coupled_modes_t
   use driven_modes, only: resonant
   use forced_responses, only: by_constant, by_harmonic, response_at, forced_response_t, unit_responses_t
   use kinds, only: pi, wp
   use load_courses, only: load_segment_t
   use power_integrals, only: power_form_t
   implicit none (type, external)
   private
   public :: forced_terms, surrogate_count, surrogate_frequencies, surrogate_amplitudes

   !> A term is slow if the magnitude of its exponent times the length of the run is less than this.
   real(wp), parameter :: max_slow = 0.1_wp
   !> Terms are slow, too, if the quasi-static response of a mode to the loads exceeds this number of units of
   !> displacement, or its rate this number per unit of tau: the segments of a table are so short that the motion stays
   !> far below it.
   real(wp), parameter :: max_units = 1.0e4_wp
   !> A harmonic load of frequency w is in resonance with a term exp(s t) if |s - i w| is less than this fraction of w.
   real(wp), parameter :: near = 1.0e-3_wp
   !> Maximum of w times the length of a phase with such a load: amid the frequencies of the surrogates.
   real(wp), parameter :: max_angle = 2.0_wp

   !> Number of surrogate harmonics. They reproduce exp(i w t) during a phase to rounding if w times the length of the
   !> phase is at most `lowest`.
   integer, parameter :: surrogate_count = 12
   !> Factors of the length of the phase; the factor with the largest distance of the frequencies from the exponents is
   !> taken.
   real(wp), parameter :: stretches(4) = [1.0_wp, 1.05_wp, 1.11_wp, 1.18_wp]
   !> Minimum of the frequencies of the harmonics times the length of the phase.
   real(wp), parameter :: lowest = 0.5_wp
   !> Maximum of the frequencies of the harmonics times the length of the phase.
   real(wp), parameter :: highest = 3.5_wp

   ! implied-do variable of the following constant
   integer :: k
   !> Squares of the frequencies of the harmonics times the length of the phase: the Chebyshev points between lowest^2
   !> and highest^2.
   real(wp), parameter :: square(surrogate_count) = [(0.5_wp*(highest**2 + lowest**2) &
      + 0.5_wp*(highest**2 - lowest**2)*cos(pi*(real(k, wp) - 0.5_wp)/real(surrogate_count, wp)), k=1, surrogate_count)]

contains

   !> Load response of a set of closed contacts, some of them compliant, at the start of a phase.
   subroutine forced_terms(constrained, coupled, compliant, spring, loads, is_new, set, forced)
      type(constrained_set_t), intent(in) :: constrained
      type(coupled_modes_t), intent(in) :: coupled
      !> Indices of the closed compliant contacts
      integer, intent(in) :: compliant(:)
      !> Dynamic stiffnesses of all contacts, [contacts]
      type(dynamic_stiffness_t), intent(in) :: spring(:)
      type(applied_loads_t), intent(in) :: loads
      !> Whether this is the first phase of the set under these loads
      logical, intent(in) :: is_new
      type(unit_responses_t), intent(inout) :: set
      !> Contains the load response of the set without surrogates
      type(forced_response_t), intent(inout) :: forced

      if (is_new) set%has_slow_terms = any(abs(coupled%exponent)*loads%duration < max_slow) .or. &
         largest_response(loads, set) > max_units .or. any(is_resonant(coupled%exponent, loads%frequency))
      if (set%has_slow_terms) call add_surrogates(constrained, coupled, compliant, spring, loads, set, forced)
      if (set%has_slow_terms .or. is_new) call prepare_work_terms(coupled%exponent, coupled%shape, loads, set)
   end subroutine forced_terms

   !> Whether each harmonic load is in resonance with a term.
   pure function is_resonant(exponent, frequency) result(answer)
      complex(wp), intent(in) :: exponent(:)
      !> Circular frequency of each load; 0: the load is not harmonic, [loads]
      real(wp), intent(in) :: frequency(:)
      logical :: answer(size(frequency))

      integer :: g

      answer = [(any(abs(exponent - cmplx(0.0_wp, frequency(g), wp)) < near*frequency(g)), g=1, size(frequency))]
   end function is_resonant

   !> Bound on the constant of the quasi-static response of the modes to constant and linear loads, and on its rate.
   pure real(wp) function largest_response(loads, set) result(response)
      type(applied_loads_t), intent(in) :: loads
      type(unit_responses_t), intent(in) :: set

      real(wp) :: of_mode(set%at%gaps)
      integer :: g

      of_mode = 0.0_wp
      do g = 1, loads%count
         associate (slope => largest_slope(loads%course(g)))
            of_mode = of_mode + abs(set%constant(:set%at%gaps, g))*max(largest_value(loads%course(g)), slope) &
               + abs(set%ramp(:set%at%gaps, g))*slope
         end associate
      end do
      response = maxval([0.0_wp, of_mode])
   end function largest_response

   !> Prepare a set with closed compliant contacts for the work of loads and the losses in stops.
   subroutine prepare_work_terms(exponent, shape, loads, forced)
      !> Exponents of the terms, [count]
      complex(wp), intent(in) :: exponent(:)
      !> Modes of the set per unit of each term, [modes, count]
      complex(wp), intent(in) :: shape(:, :)
      type(applied_loads_t), intent(in) :: loads
      type(unit_responses_t), intent(inout) :: forced

      complex(wp) :: distance
      integer :: g, m

      ! the exponents of the stored products of terms may have changed
      forced%products = power_form_t()
      if (allocated(forced%term_load)) deallocate (forced%term_load, forced%work_plus, &
         forced%work_minus, forced%resonant_terms, forced%resonant_load)
      allocate (forced%term_load(size(exponent), loads%count), forced%work_plus(size(exponent), loads%count), &
         forced%work_minus(size(exponent), loads%count))
      allocate (forced%resonant_terms(0), forced%resonant_load(0))
      do g = 1, loads%count
         do m = 1, size(exponent)
            forced%term_load(m, g) = sum(shape(:, m)*forced%load(:, g))
            associate (rate => exponent(m)*forced%term_load(m, g))
               forced%work_plus(m, g) = rate/(exponent(m) + cmplx(0.0_wp, loads%frequency(g), wp))
               forced%work_minus(m, g) = (0.0_wp, 0.0_wp)
               distance = exponent(m) - cmplx(0.0_wp, loads%frequency(g), wp)
               if (abs(distance) > resonant*loads%frequency(g)) then
                  forced%work_minus(m, g) = rate/distance
               else if (loads%frequency(g) > 0.0_wp) then
                  forced%resonant_terms = [forced%resonant_terms, m]
                  forced%resonant_load = [forced%resonant_load, g]
               end if
            end associate
         end do
      end do
   end subroutine prepare_work_terms

   !> Replace the constants, slopes, and slow or resonant harmonics of the loads by surrogate harmonics.
   subroutine add_surrogates(constrained, coupled, compliant, spring, loads, set, forced)
      type(constrained_set_t), intent(in) :: constrained
      type(coupled_modes_t), intent(in) :: coupled
      !> Indices of the closed compliant contacts
      integer, intent(in) :: compliant(:)
      !> Dynamic stiffnesses of all contacts, [contacts]
      type(dynamic_stiffness_t), intent(in) :: spring(:)
      type(applied_loads_t), intent(in) :: loads
      type(unit_responses_t), intent(in) :: set
      !> Contains the start and the segments of the phase
      type(forced_response_t), intent(inout) :: forced

      complex(wp), allocatable :: harmonic(:, :)
      type(load_segment_t) :: segment
      real(wp) :: length, clearances(size(stretches))
      logical :: has_resonance(loads%count)
      integer :: g, k, harmonic_count

      has_resonance = is_resonant(coupled%exponent, loads%frequency) .and. abs(forced%segment%harmonic) > 0.0_wp
      forced%until = minval([forced%until, forced%tau + loads%duration, &
         forced%tau + max_angle/pack(loads%frequency, has_resonance)])
      length = forced%until - forced%tau
      clearances = [(min_clearance([coupled%exponent, cmplx(-constrained%oscillators%decay(coupled%inactive), &
         constrained%oscillators%spread(coupled%inactive), wp)], &
         surrogate_frequencies(length*stretches(k))), k=1, size(stretches))]
      length = length*stretches(maxloc(clearances, dim=1))
      harmonic_count = size(loads%frequencies)
      forced%frequency = [loads%frequencies, surrogate_frequencies(length)]
      allocate (harmonic(set%at%rows, harmonic_count + surrogate_count), source=(0.0_wp, 0.0_wp))
      do g = 1, loads%count
         segment = forced%segment(g)
         if (loads%harmonic(g) > 0) then
            if (segment%frequency*length < lowest .or. has_resonance(g)) then
               call add_part(load_segment_t(harmonic=segment%harmonic, frequency=segment%frequency), &
                  set%driven%part == by_harmonic .and. set%driven%load == g)
            else
               associate (m => loads%harmonic(g))
                  harmonic(:, m) = harmonic(:, m) + segment%harmonic*set%harmonic(:, g)
               end associate
            end if
         end if
         call add_part(load_segment_t(constant=segment%constant, slope=segment%slope), set%driven%part == by_constant)
      end do
      call move_alloc(harmonic, forced%harmonic)
      forced%constant(:) = 0.0_wp
      forced%slope(:) = 0.0_wp

   contains

      !> Add the surrogates of a part of the load segment g.
      subroutine add_part(part, is_left_out)
         type(load_segment_t), intent(in) :: part
         !> Whether the mode of each entry of `driven` is driven from rest by this part, and left out
         logical, intent(in) :: is_left_out(:)

         complex(wp) :: response(set%at%rows), surrogate(surrogate_count)
         logical :: is_driven(constrained%count)
         integer :: i

         call surrogate_amplitudes(part, length, surrogate)
         if (all(abs(surrogate) <= 0.0_wp)) return
         is_driven = .false.
         is_driven(pack(set%driven%mode, is_left_out)) = .true.
         do i = 1, surrogate_count
            call response_at(constrained, compliant, spring, set, g, &
               cmplx(0.0_wp, forced%frequency(harmonic_count + i), wp), is_driven, response)
            harmonic(:, harmonic_count + i) = harmonic(:, harmonic_count + i) + surrogate(i)*response
         end do
      end subroutine add_part
   end subroutine add_surrogates

   !> Frequencies of the surrogate harmonics for a phase of given length.
   pure function surrogate_frequencies(length) result(frequency)
      real(wp), intent(in) :: length
      real(wp) :: frequency(surrogate_count)

      frequency = sqrt(square)/length
   end function surrogate_frequencies

   !> Minimum distance of i times the frequencies from all exponents, relative to the frequency.
   pure real(wp) function min_clearance(exponent, frequency) result(clearance)
      complex(wp), intent(in) :: exponent(:)
      real(wp), intent(in) :: frequency(:)

      integer :: k

      clearance = minval([(minval(abs(cmplx(0.0_wp, frequency(k), wp) - exponent))/frequency(k), k=1, size(frequency))])
   end function min_clearance

   !> Amplitudes of the surrogate harmonics for a load segment: cos(w t) and sin(w t)/w are interpolated as functions of
   !> w^2.
   pure subroutine surrogate_amplitudes(segment, length, surrogate)
      type(load_segment_t), intent(in) :: segment
      !> Length of the phase, stretched
      real(wp), intent(in) :: length
      !> Re sum surrogate exp(i w t) equals constant + slope t + Re(harmonic exp(i frequency t))
      complex(wp), intent(out) :: surrogate(surrogate_count)

      associate (w => surrogate_frequencies(length))
         surrogate = weights_at(0.0_wp)*cmplx(segment%constant, -segment%slope/w, wp) &
            + weights_at((segment%frequency*length)**2) &
            *cmplx(real(segment%harmonic, wp), aimag(segment%harmonic)*segment%frequency/w, wp)
      end associate
   end subroutine surrogate_amplitudes

   !> Lagrange polynomials through the points `square`, at x: the squared frequency times the squared length.
   pure function weights_at(x) result(surrogate)
      real(wp), intent(in) :: x
      real(wp) :: surrogate(surrogate_count)

      logical :: is_other(surrogate_count)
      integer :: k

      do k = 1, surrogate_count
         is_other = abs(square(k) - square) > 0.0_wp
         surrogate(k) = product(x - square, mask=is_other)/product(square(k) - square, mask=is_other)
      end do
   end function weights_at

end module surrogate_loads
