!> Motion of the beam with a given set of closed contacts: its state in a phase, the motion between two events, and its
!> response to a force at a contact (docs/theory.md, sections 17 and 18).
module set_motions
   use compliant_stop, only: is_rigid_stop
   use contact_sets, only: contact_set_t
   use coupled_modes, only: terms_at
   use damped_oscillators, only: lanes, propagate
   use kinds, only: wp
   use point_forces, only: find_point_forces
   use power_integrals, only: find_interval_terms
   implicit none (type, external)
   private
   public :: find_end_terms, state_in, state_of_terms, point_response, exponents_of, is_unsuitable, min_modulus

   !> Minimum of half the difference of the two exponents of a mode over the modal frequency; nearer to critical damping
   !> the amplitudes of the two terms become too large.
   real(wp), parameter :: min_spread = 0.02_wp
   !> Limits of |s|, per unit of tau, far inside the range where |s|**6 and |s|**7, which bound the derivatives of a
   !> row, neither overflow nor underflow.
   real(wp), parameter :: min_modulus = 1.0e-3_wp, max_modulus = 1.0e20_wp

contains

   !> Exponents of the motion of the set without loads: one of each conjugate pair, and both of each overdamped mode.
   pure function exponents_of(set) result(exponent)
      type(contact_set_t), intent(in) :: set
      complex(wp), allocatable :: exponent(:)

      if (size(set%compliant) > 0) then
         exponent = set%coupled%exponent
      else
         associate (oscillators => set%constrained%oscillators)
            associate (n => oscillators%count, underdamped => oscillators%underdamped)
               exponent = [cmplx(-oscillators%decay(:n), [oscillators%spread(:underdamped), &
                  0.0_wp*oscillators%spread(underdamped + 1:n)], wp), &
                  cmplx(-oscillators%decay(underdamped + 1:n) - 2.0_wp*oscillators%spread(underdamped + 1:n), 0.0_wp, &
                  wp)]
            end associate
         end associate
      end if
   end function exponents_of

   !> Whether the exponents do not suit the rows, because amplitudes or bounds would be out of range, or because some
   !> modes with nodes at all compliant contacts (`inactive`) have no exponents among them.
   pure logical function is_unsuitable(set, exponent) result(is)
      type(contact_set_t), intent(in) :: set
      complex(wp), intent(in) :: exponent(:)

      is = size(exponent) == 0
      if (is) return
      is = any(abs(exponent) > max_modulus) .or. any(abs(exponent) < min_modulus)
      if (size(set%compliant) > 0) then
         is = is .or. size(set%coupled%inactive) > 0
      else
         associate (oscillators => set%constrained%oscillators)
            is = is .or. any(oscillators%spread(:oscillators%count) < min_spread*oscillators%frequency)
         end associate
      end if
   end function is_unsuitable

   !> Response of the set's modes to a unit force at contact k, [modes]: the modal forces over `divisor` (W^2: static
   !> displacements). If each mode has its own damping ratio, closed rigid contacts are not constraints of the set: they
   !> are in the list `set%compliant` of contacts that apply forces (theory, section 18). In this response the points of
   !> the beam at all closed rigid contacts stay fixed in either case.
   pure function point_response(set, k, divisor) result(shape)
      type(contact_set_t), intent(in) :: set
      integer, intent(in) :: k
      real(wp), intent(in) :: divisor(:)
      real(wp) :: shape(size(divisor))

      complex(wp), allocatable :: force(:), zero(:)
      complex(wp) :: response(size(divisor))
      integer, allocatable :: rigid(:)

      associate (value => set%constrained%value)
         shape = value(:, k)/divisor
         if (size(set%compliant) == 0) return
         if (.not. any(is_rigid_stop(set%coupled%spring))) return
         allocate (rigid, source=pack(set%compliant, is_rigid_stop(set%coupled%spring)))
         allocate (force(size(rigid)), zero(size(rigid)))
         zero = (0.0_wp, 0.0_wp)
         ! D_i is `divisor`, the load is that of the unit force; the points have neither flexibility nor gap
         call find_point_forces(cmplx(divisor, 0.0_wp, wp), value(:, rigid), zero, cmplx(value(:, k), 0.0_wp, wp), &
            zero, force, response)
         shape = real(response, wp)
      end associate
   end function point_response

   !> Values of the terms at the end of a phase, [terms]. If losses are prepared (`set%losses`), `set%span`
   !> receives these values, too: the integrals of losses and impulses use it.
   pure subroutine find_end_terms(set, amplitude, time, term)
      type(contact_set_t), intent(inout) :: set
      !> Amplitudes of the terms, with their weights, at the start of the phase, [terms]
      complex(wp), intent(in) :: amplitude(:)
      !> Time since the start of the phase
      real(wp), intent(in) :: time
      complex(wp), intent(out) :: term(:)

      if (allocated(set%losses)) then
         ! `find_interval_terms` reads only the exponents of the power form, which all forms of the set share
         call find_interval_terms(set%losses(1), amplitude, time, set%span)
         term = set%span%term
      else
         term = terms_at(set%coupled, amplitude, time)
      end if
   end subroutine find_end_terms

   !> State of the constrained modes with closed compliant contacts at a time in the phase.
   pure subroutine state_in(set, amplitude, z0, v0, time, z, v)
      type(contact_set_t), intent(in) :: set
      !> Amplitudes of the terms, with their weights, at the start of the phase, [terms]
      complex(wp), intent(in) :: amplitude(:)
      !> Displacements at the start of the phase, [modes]; only those of modes with nodes at all compliant contacts
      !> (`set%coupled%inactive`) are read
      real(wp), intent(in) :: z0(:)
      !> Velocities at the start of the phase, [modes]; only those of the same modes are read
      real(wp), intent(in) :: v0(:)
      !> Time since the start of the phase
      real(wp), intent(in) :: time
      real(wp), intent(out) :: z(:)
      real(wp), intent(out) :: v(:)

      call state_of_terms(set, terms_at(set%coupled, amplitude, time), z0, v0, time, z, v)
   end subroutine state_in

   !> State of the constrained modes from the values of the terms at a time since the start of the phase.
   pure subroutine state_of_terms(set, term, z0, v0, time, z, v)
      type(contact_set_t), intent(in) :: set
      !> Amplitudes of the terms, with their weights, at the time, [terms]
      complex(wp), intent(in) :: term(:)
      !> Displacements at the start of the phase, [modes]; only those of modes with nodes at all compliant contacts
      !> (`set%coupled%inactive`) are read
      real(wp), intent(in) :: z0(:)
      !> Velocities at the start of the phase, [modes]; only those of the same modes are read
      real(wp), intent(in) :: v0(:)
      !> Time since the start of the phase
      real(wp), intent(in) :: time
      real(wp), intent(out) :: z(:)
      real(wp), intent(out) :: v(:)

      real(wp), dimension(size(z0)) :: uncoupled, uncoupled_rate
      ! displacements and velocities of the modes, padded to whole SIMD vectors
      real(wp), dimension(lanes*size(set%coupled%shape_parts, 4)) :: lane_z, lane_v
      ! real and minus imaginary parts of the terms, and then of their rates
      real(wp) :: x(4, set%coupled%count)
      ! products of these parts and the parts of the shapes for one vector of modes, summed in registers
      real(wp), dimension(lanes) :: v_imag, v_real, z_imag, z_real
      complex(wp) :: rate
      integer :: i, m, panel

      do m = 1, size(x, 2)
         rate = term(m)*set%coupled%exponent(m)
         x(:, m) = [real(term(m), wp), -aimag(term(m)), real(rate, wp), -aimag(rate)]
      end do
      associate (shape_parts => set%coupled%shape_parts)
         do panel = 1, size(shape_parts, 4)
            z_real = 0.0_wp
            z_imag = 0.0_wp
            v_real = 0.0_wp
            v_imag = 0.0_wp
            do m = 1, size(x, 2)
               !$omp simd
               do i = 1, lanes
                  z_real(i) = z_real(i) + x(1, m)*shape_parts(i, 1, m, panel)
                  z_imag(i) = z_imag(i) + x(2, m)*shape_parts(i, 2, m, panel)
                  v_real(i) = v_real(i) + x(3, m)*shape_parts(i, 1, m, panel)
                  v_imag(i) = v_imag(i) + x(4, m)*shape_parts(i, 2, m, panel)
               end do
            end do
            lane_z(lanes*(panel - 1) + 1:lanes*panel) = z_real + z_imag
            lane_v(lanes*(panel - 1) + 1:lanes*panel) = v_real + v_imag
         end do
      end associate
      z = set%rest_modes + lane_z(:size(z))
      v = lane_v(:size(v))
      if (size(set%coupled%inactive) == 0) return
      call propagate(set%constrained%oscillators, time, z0, v0, uncoupled, uncoupled_rate)
      z(set%coupled%inactive) = uncoupled(set%coupled%inactive)
      v(set%coupled%inactive) = uncoupled_rate(set%coupled%inactive)
   end subroutine state_of_terms

end module set_motions
