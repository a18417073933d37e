!> Work of loads on a beam during a phase (the motion between two events), impulses of the load response, and
!> dissipation in a stop under loads, in closed form (docs/theory.md, section 18). The motion of a phase is the load
!> response plus a homogeneous part: free vibration of the modes, or terms exp(s t) if compliant contacts are closed.
!> The work is the sum of the works on both. W is the frequency of a mode, w that of a load harmonic, and ' is d/dtau.
module load_work
   use coupled_modes, only: terms_at
   use driven_modes, only: driven_mode_at, integral_of, make_driven_mode, work_on, work_on_free_motion
   use forced_responses, only: by_constant, by_harmonic
   use kinds, only: wp
   use load_courses, only: load_segment_t
   use phase_state, only: phase_state_t
   use power_integrals, only: find_interval_terms, integral, make_power_form, interval_terms_t, energy_over
   implicit none (type, external)
   private
   public :: work_of_loads, loss_in_stop, load_response_impulse

contains

   !> Work of all loads from the start of the phase to a time.
   real(wp) function work_of_loads(self, time, phasor, z, v, term) result(work)
      type(phase_state_t), intent(in) :: self
      real(wp), intent(in) :: time
      !> exp(i w t), [harmonics]
      complex(wp), intent(in) :: phasor(:)
      !> Displacements of the constrained modes at that time without the load response (homogeneous part), [modes]
      real(wp), contiguous, intent(in) :: z(:)
      !> Velocities of the constrained modes at that time without the load response (homogeneous part), [modes]
      real(wp), contiguous, intent(in) :: v(:)
      !> Values of the terms exp(s t) at that time if a compliant contact is closed, [terms]
      complex(wp), intent(in) :: term(:)

      real(wp) :: uncoupled(size(z))

      work = 0.0_wp
      if (self%loads%count == 0 .or. .not. time > 0.0_wp) return
      work = work_on_load_response(self, time, phasor)
      uncoupled = 1.0_wp
      if (size(self%set%compliant) > 0) then
         work = work + work_on_terms(self, time, phasor, term)
         if (size(self%set%coupled%inactive) == 0) return
         uncoupled = 0.0_wp
         uncoupled(self%set%coupled%inactive) = 1.0_wp
      end if
      call add_uncoupled_modes(self, uncoupled, time, phasor, z, v, work)
   end function work_of_loads

   !> Add the work on modes in free vibration, z'' + 2 a z' + W^2 z = 0, with a the decay rate of the mode. An
   !> antiderivative of z is -(z' + 2 a z)/W^2, one of exp(s t) z' is exp(s t)(s z' + W^2 z)/(s^2 - 2 a s + W^2). If
   !> these forms would lose digits by cancellation, the closed form of a mode driven from rest is used.
   pure subroutine add_uncoupled_modes(self, uncoupled, time, phasor, z, v, work)
      type(phase_state_t), intent(in) :: self
      !> 1: the mode vibrates freely, 0: the mode is coupled to compliant contacts, [modes]
      real(wp), contiguous, intent(in) :: uncoupled(:)
      real(wp), intent(in) :: time
      !> exp(i w t), [harmonics]
      complex(wp), intent(in) :: phasor(:)
      !> Displacements of the modes at that time, homogeneous part, [modes]
      real(wp), contiguous, intent(in) :: z(:)
      !> Velocities of the modes at that time, homogeneous part, [modes]
      real(wp), contiguous, intent(in) :: v(:)
      real(wp), intent(inout) :: work

      type(load_segment_t) :: ramp, harmonic_part
      logical :: has_driven, has_ramp, has_harmonic
      integer :: g, m

      has_driven = size(self%set%forced%driven) > 0
      associate (set => self%set%forced, oscillators => self%set%constrained%oscillators, &
         segment => self%forced%segment)
         do g = 1, self%loads%count
            has_ramp = abs(segment(g)%constant) + abs(segment(g)%slope) > 0.0_wp
            has_harmonic = is_nonzero(segment(g)%harmonic)
            if (has_harmonic) work = work + work_of_harmonic(segment(g), phasor(self%loads%harmonic(g)), uncoupled, &
               oscillators%square, set%adjoint(:, g), self%z, self%v, z, v)
            if (.not. (has_ramp .or. has_driven)) cycle
            ramp = segment(g)
            ramp%harmonic = 0.0_wp
            harmonic_part = load_segment_t(harmonic=segment(g)%harmonic, frequency=segment(g)%frequency)
            do m = 1, size(z)
               if (.not. uncoupled(m) > 0.0_wp) cycle
               associate (load => set%load(m, g), square => oscillators%square(m), &
                  is_slow => has_driven .and. is_driven(self, m, by_constant, 0))
                  if (is_slow) work = work + load*work_on_free_motion(make_driven_mode(oscillators, m), &
                     [self%z(m), self%v(m)], ramp, time)
                  if (has_driven .and. has_harmonic) then
                     if (is_driven(self, m, by_harmonic, g)) work = work &
                        + load*work_on_free_motion(make_driven_mode(oscillators, m), [self%z(m), self%v(m)], &
                        harmonic_part, time)
                  end if
                  if (has_ramp .and. .not. is_slow) then
                     work = work + load*ramp%constant*(z(m) - self%z(m))
                     if (abs(ramp%slope) > 0.0_wp) work = work + load*ramp%slope*(time*z(m) + (v(m) - self%v(m) &
                        + (oscillators%two_zeta*square + oscillators%mass_rate(m))*(z(m) - self%z(m)))/square)
                  end if
               end associate
            end do
         end do
      end associate
   end subroutine add_uncoupled_modes

   !> Work of a harmonic load on modes in free vibration.
   pure real(wp) function work_of_harmonic(load, phasor, uncoupled, square, adjoint, z0, v0, z, v) result(work)
      type(load_segment_t), intent(in) :: load
      !> exp(i w t) of the load
      complex(wp), intent(in) :: phasor
      !> 1: the mode vibrates freely, 0: the mode is coupled to compliant contacts, [modes]
      real(wp), contiguous, intent(in) :: uncoupled(:)
      !> W^2, [modes]
      real(wp), contiguous, intent(in) :: square(:)
      !> `unit_responses_t%adjoint` of the load, zero for modes driven from rest, [modes]
      complex(wp), contiguous, intent(in) :: adjoint(:)
      !> Displacements at the start of the phase, [modes]
      real(wp), contiguous, intent(in) :: z0(:)
      !> Velocities at the start of the phase, [modes]
      real(wp), contiguous, intent(in) :: v0(:)
      !> Displacements at the time, [modes]
      real(wp), contiguous, intent(in) :: z(:)
      !> Velocities at the time, [modes]
      real(wp), contiguous, intent(in) :: v(:)

      ! change of exp(i w t) (W^2 z + i w z') of a mode since the start of the phase
      real(wp) :: real_change, imaginary_change
      ! sum of the work over the modes, real and imaginary part
      real(wp) :: real_part, imaginary_part
      real(wp) :: cosine, sine
      integer :: i

      cosine = real(phasor, wp)
      sine = aimag(phasor)
      real_part = 0.0_wp
      imaginary_part = 0.0_wp
      !$omp simd reduction(+:real_part, imaginary_part) private(real_change, imaginary_change)
      do i = 1, size(z)
         associate (p => square(i)*z(i), r => load%frequency*v(i))
            real_change = uncoupled(i)*(p*cosine - r*sine - square(i)*z0(i))
            imaginary_change = uncoupled(i)*(p*sine + r*cosine - load%frequency*v0(i))
         end associate
         real_part = real_part + (real(adjoint(i), wp)*real_change - aimag(adjoint(i))*imaginary_change)
         imaginary_part = imaginary_part + (real(adjoint(i), wp)*imaginary_change + aimag(adjoint(i))*real_change)
      end do
      work = real(load%harmonic, wp)*real_part - aimag(load%harmonic)*imaginary_part
   end function work_of_harmonic

   !> Whether the amplitude of a harmonic is nonzero.
   elemental logical function is_nonzero(harmonic) result(answer)
      complex(wp), intent(in) :: harmonic

      answer = abs(real(harmonic, wp)) + abs(aimag(harmonic)) > 0.0_wp
   end function is_nonzero

   !> Whether a mode is driven from rest by this part of a load.
   pure logical function is_driven(self, mode, part, load) result(answer)
      type(phase_state_t), intent(in) :: self
      integer, intent(in) :: mode
      !> One of the `by_` constants
      integer, intent(in) :: part
      !> Index of the load; 0: all loads
      integer, intent(in) :: load

      associate (driven => self%set%forced%driven)
         answer = any(driven%mode == mode .and. driven%part == part .and. driven%load == load)
      end associate
   end function is_driven

   !> Work of all loads on the exponential terms of a motion with compliant contacts.
   pure real(wp) function work_on_terms(self, time, phasor, term) result(work)
      type(phase_state_t), intent(in) :: self
      real(wp), intent(in) :: time
      !> exp(i w t), [harmonics]
      complex(wp), intent(in) :: phasor(:)
      !> Values of the terms at that time, [terms]
      complex(wp), intent(in) :: term(:)

      complex(wp) :: power(size(term)), s
      integer :: g, m

      work = 0.0_wp
      if (any(abs(self%forced%segment%slope) > 0.0_wp)) power = terms_at(self%set%coupled, [((1.0_wp, 0.0_wp), m=1, &
         size(term))], time)
      associate (set => self%set%forced, coupled => self%set%coupled, amplitude => self%amplitude)
         do g = 1, self%loads%count
            associate (segment => self%forced%segment(g), load => set%term_load(:, g))
               if (abs(segment%constant) > 0.0_wp) work = work + segment%constant*sum(real(load*(term - amplitude), wp))
               if (abs(segment%slope) > 0.0_wp) then
                  do m = 1, coupled%count
                     work = work + segment%slope*real(load(m)*(time*term(m) - amplitude(m)*integral( &
                        coupled%exponent(m), time, power(m))), wp)
                  end do
               end if
               if (.not. is_nonzero(segment%harmonic)) cycle
               associate (c => segment%harmonic, rotation => phasor(self%loads%harmonic(g)), &
                  sigma => cmplx(0.0_wp, segment%frequency, wp))
                  work = work + 0.5_wp*real(c*work_of_rotation(set%work_plus(:, g), coupled%exponent + sigma, time, &
                     rotation, term, amplitude) + conjg(c)*work_of_rotation(set%work_minus(:, g), &
                     coupled%exponent - sigma, time, conjg(rotation), term, amplitude), wp)
                  do m = 1, size(set%resonant_terms)
                     if (set%resonant_load(m) /= g) cycle
                     associate (i => set%resonant_terms(m))
                        s = coupled%exponent(i) - sigma
                        work = work + 0.5_wp*real(conjg(c)*coupled%exponent(i)*load(i)*amplitude(i) &
                           *integral(s, time, exp(s*time)), wp)
                     end associate
                  end do
               end associate
            end associate
         end do
      end associate
   end function work_on_terms

   !> Weighted sum over the terms: change of exp(sigma t) times the term since the start of the phase.
   pure function work_of_rotation(weight, exponent, time, rotation, term, amplitude) result(work)
      !> Weight of each term, [terms]
      complex(wp), contiguous, intent(in) :: weight(:)
      !> Exponents of the products of exp(sigma t) and the terms, [terms]
      complex(wp), intent(in) :: exponent(:)
      real(wp), intent(in) :: time
      !> exp(sigma t) at the end
      complex(wp), intent(in) :: rotation
      !> The terms at the end, [terms]
      complex(wp), contiguous, intent(in) :: term(:)
      !> The terms at the start, [terms]
      complex(wp), contiguous, intent(in) :: amplitude(:)
      complex(wp) :: work

      ! below this product of exponent and time, the difference of the values at the two ends would lose digits
      real(wp), parameter :: cancels = 0.1_wp
      integer :: m

      work = (0.0_wp, 0.0_wp)
      do m = 1, size(weight)
         if ((abs(real(exponent(m), wp)) + abs(aimag(exponent(m))))*time < cancels) then
            work = work + weight(m)*exponent(m)*amplitude(m)*integral(exponent(m), time, (1.0_wp, 0.0_wp))
         else
            work = work + weight(m)*(rotation*term(m) - amplitude(m))
         end if
      end do
   end function work_of_rotation

   !> Work of all loads on the load response: on modes driven from rest, and on the displacements along the loads
   !> (work-conjugate displacements), which have the form constant + slope t + harmonics.
   pure real(wp) function work_on_load_response(self, time, phasor) result(work)
      type(phase_state_t), intent(in) :: self
      real(wp), intent(in) :: time
      !> exp(i w t), [harmonics]
      complex(wp), intent(in) :: phasor(:)

      integer :: g, i, m
      ! exp(i w t) of a load
      complex(wp) :: load_phasor
      ! amplitude of the displacement along the load at one of the load frequencies
      complex(wp) :: row

      work = 0.0_wp
      associate (set => self%set%forced, forced => self%forced)
         do g = 1, self%loads%count
            do i = 1, size(forced%pair)
               work = work + set%load(set%driven(forced%pair(i))%mode, g)*work_on(forced%mode(i), forced%segment(g), &
                  time)
            end do
            load_phasor = (1.0_wp, 0.0_wp)
            if (self%loads%harmonic(g) > 0) load_phasor = phasor(self%loads%harmonic(g))
            associate (segment => forced%segment(g))
               work = work + forced%slope(set%at%loads + g)*(segment%constant + 0.5_wp*segment%slope*time)*time
               if (is_nonzero(segment%harmonic) .and. abs(forced%slope(set%at%loads + g)) > 0.0_wp) then
                  associate (s => cmplx(0.0_wp, segment%frequency, wp))
                     work = work + forced%slope(set%at%loads + g)*real(segment%harmonic*integral(s, time, &
                        load_phasor), wp)
                  end associate
               end if
               do m = 1, size(forced%frequency)
                  row = forced%harmonic(set%at%loads + g, m)
                  if (is_nonzero(row)) work = work + work_on_harmonic(segment, load_phasor, row, &
                     forced%frequency(m), phasor(m), time)
               end do
            end associate
         end do
      end associate
   end function work_on_load_response

   !> Work of a load whose work-conjugate displacement is Re(row exp(i omega t)), with a frequency omega that may be
   !> that of another load.
   pure real(wp) function work_on_harmonic(load, load_phasor, row, omega, phasor, time) result(work)
      type(load_segment_t), intent(in) :: load
      !> exp(i w t) of the harmonic of this load
      complex(wp), intent(in) :: load_phasor
      !> Complex amplitude of the displacement
      complex(wp), intent(in) :: row
      !> Frequency omega of the displacement
      real(wp), intent(in) :: omega
      !> exp(i omega t)
      complex(wp), intent(in) :: phasor
      real(wp), intent(in) :: time

      complex(wp) :: s

      s = cmplx(0.0_wp, omega, wp)
      work = 0.0_wp
      if (abs(load%constant) > 0.0_wp) work = load%constant*real(row*(phasor - 1.0_wp), wp)
      if (abs(load%slope) > 0.0_wp) work = work + load%slope*real(row*(time*phasor - integral(s, time, phasor)), wp)
      if (.not. is_nonzero(load%harmonic)) return
      associate (plus => cmplx(0.0_wp, omega + load%frequency, wp), &
         minus => cmplx(0.0_wp, omega - load%frequency, wp))
         work = work + 0.5_wp*real(s*row*(load%harmonic*integral(plus, time, phasor*load_phasor) &
            + conjg(load%harmonic)*integral(minus, time, phasor*conjg(load_phasor))), wp)
      end associate
   end function work_on_harmonic

   !> Energy dissipated in the damper of a closed compliant contact. With a branch (damper and second spring in series)
   !> the energy is the integral of the squared branch force, else of the squared indentation rate, times a factor.
   !> Force and rate are sums of exponential terms.
   real(wp) function loss_in_stop(self, place, time) result(loss)
      type(phase_state_t), intent(inout) :: self
      !> Index among the compliant contacts of the set
      integer, intent(in) :: place
      real(wp), intent(in) :: time

      complex(wp), allocatable :: amplitude(:)
      type(interval_terms_t) :: span
      real(wp) :: factor
      integer :: row

      associate (set => self%set, coupled => self%set%coupled, forced => self%forced, &
         spring => self%set%coupled%spring(place))
         if (spring%branch_stiffness > 0.0_wp) then
            factor = spring%relaxation_rate/spring%branch_stiffness
            row = set%forced%at%branches + set%compliant(place)
            allocate (amplitude, source=[coupled%branch(place, :)*self%amplitude, forced%harmonic(row, :), &
               cmplx(forced%constant(row), 0.0_wp, wp)])
         else
            factor = spring%viscosity
            row = set%forced%at%indentations + set%compliant(place)
            allocate (amplitude, source=[coupled%exponent*coupled%indentation(place, :)*self%amplitude, &
               cmplx(0.0_wp, forced%frequency, wp)*forced%harmonic(row, :), cmplx(forced%slope(row), 0.0_wp, wp)])
         end if
         if (.not. allocated(set%forced%products%matrix)) call make_power_form([coupled%exponent, &
            cmplx(0.0_wp, forced%frequency, wp), (0.0_wp, 0.0_wp)], &
            reshape([((1.0_wp, 0.0_wp), row=1, size(amplitude))], [1, size(amplitude)]), set%forced%products)
         call find_interval_terms(set%forced%products, amplitude, time, span)
         loss = factor*energy_over(set%forced%products, span)
      end associate
   end function loss_in_stop

   !> Contribution of the load response to the integral of a contact force.
   real(wp) function load_response_impulse(self, k, time) result(impulse)
      type(phase_state_t), intent(in) :: self
      integer, intent(in) :: k
      real(wp), intent(in) :: time

      real(wp) :: mode_state(0:1)
      integer :: i, row

      associate (set => self%set%forced, forced => self%forced)
         row = set%at%forces + k
         impulse = (forced%constant(row) + 0.5_wp*forced%slope(row)*time)*time
         do i = 1, size(forced%frequency)
            associate (s => cmplx(0.0_wp, forced%frequency(i), wp))
               impulse = impulse + real(forced%harmonic(row, i)*integral(s, time, exp(s*time)), wp)
            end associate
         end do
         do i = 1, size(forced%pair)
            mode_state = driven_mode_at(forced%mode(i), time, 1)
            associate (pair => set%driven(forced%pair(i)))
               impulse = impulse + pair%row_of_rate(row)*mode_state(0) + pair%row(row)*integral_of(forced%mode(i), time)
            end associate
         end do
      end associate
   end function load_response_impulse

end module load_work
