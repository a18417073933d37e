!> Load response of a beam with one set of closed contacts, in closed form on each load segment (docs/theory.md, section
!> 18). The motion is the load response plus a free motion; t is the time since the start of the phase, W the frequency
!> of a mode, and w that of a load harmonic.
!>
!> Each output quantity is a row (a linear functional of the motion): modes of the set, gaps, contact forces,
!> indentations and branch forces of the contacts, tip displacement, and work-conjugate displacements of the loads. The
!> load response of a row is constant + slope t + Re sum harmonic exp(i w t), plus modes driven from rest. The latter
!> are modes in resonance with a harmonic load, or so slow that their stiffness hardly matters during a phase; the sum
!> of their steady-state response and their free motion, both large, would lose digits.
module forced_responses
   use applied_loads, only: applied_loads_t, are_slow, is_slow_load, drop_balanced
   use complementarity, only: solve_active
   use compliant_stop, only: dynamic_stiffness, dynamic_stiffness_t, is_rigid_stop
   use constrained_sets, only: free_beam_t, constrained_set_t
   use damped_oscillators, only: oscillators_t
   use driven_modes, only: adjoint_of, driven_mode_at, driven_mode_t, make_driven_mode, resonates
   use driven_signal, only: driven_signal_t, phasor_of
   use kinds, only: pi, wp
   use load_courses, only: load_segment_at, load_segment_t
   use point_forces, only: find_point_forces
   use power_integrals, only: power_form_t
   implicit none (type, external)
   private
   public :: unit_responses_t, forced_response_t, make_unit_responses, start_forced_response, &
      find_rows_at
   public :: response_at, by_constant, by_harmonic

   !> Maximum number of load periods in a phase with modes driven by a harmonic load from rest. The bounds
   !> on a gap and its derivatives, by which the search for events proceeds, grow with the length of the phase.
   real(wp), parameter :: max_periods = 2.0_wp

   !> Index of the row before the first row of each kind (modes, gaps, contact forces, indentations, branch forces, tip
   !> displacement, work-conjugate displacements of the loads), and number of all rows.
   type :: row_places_t
      integer :: modes = 0
      integer :: gaps = 0
      integer :: forces = 0
      integer :: indentations = 0
      integer :: branches = 0
      integer :: tip = 0
      integer :: loads = 0
      integer :: rows = 0
   end type row_places_t

   !> Part of a load segment that drives a mode from rest: the constant.
   integer, parameter :: by_constant = 1
   !> Part of a load segment that drives a mode from rest: the slope.
   integer, parameter :: by_slope = 2
   !> Part of a load segment that drives a mode from rest: the harmonic.
   integer, parameter :: by_harmonic = 3

   !> A pair of a mode of the set and a part of the load that drives the mode from rest.
   type :: mode_from_rest_t
      integer :: mode = 0
      !> Part of the load, one of the `by_` constants
      integer :: part = 0
      !> Index of the load; 0: all loads
      integer :: load = 0
      !> Value of each row per unit of the modal displacement, [rows]
      real(wp), allocatable :: row(:)
      !> Value of each row per unit of the modal velocity, [rows]
      real(wp), allocatable :: row_of_rate(:)
   end type mode_from_rest_t

   !> Responses of the beam with a set of closed contacts to unit loads.
   type :: unit_responses_t
      !> Indices of the rows
      type(row_places_t) :: at
      !> Response to the load 1, [rows, loads]
      real(wp), allocatable :: constant(:, :)
      !> Response to the load t, minus t times the response to the load 1, [rows, loads]
      real(wp), allocatable :: ramp(:, :)
      !> Response to exp(i w t), [rows, loads]
      complex(wp), allocatable :: harmonic(:, :)
      !> Response of each uncoupled mode to exp(i w t) by the adjoint equation, which has the damping of the other sign.
      !> It gives the work of the load on the free motion in closed form, [modes, loads]
      complex(wp), allocatable :: adjoint(:, :)
      !> Modal loads of the set, [modes, loads]
      real(wp), allocatable :: load(:, :)
      !> Part of a unit load that goes directly into the reaction of each closed rigid contact, before the modes
      !> respond, [closed, loads]
      real(wp), allocatable :: balanced_fraction(:, :)
      !> Modes driven from rest, which the other components omit
      type(mode_from_rest_t), allocatable :: driven(:)
      !> With closed compliant contacts: generalized unit load of each term exp(s t) of the motion (`coupled_terms`),
      !> [count, loads]
      complex(wp), allocatable :: term_load(:, :)
      !> `term_load` times s/(s + i w), as in the integral of load times velocity with the frequency w of the load,
      !> [count, loads]
      complex(wp), allocatable :: work_plus(:, :)
      !> `term_load` times s/(s - i w), and 0 for terms in resonance with the load, [count, loads]
      complex(wp), allocatable :: work_minus(:, :)
      !> Indices of the terms in resonance with a load
      integer, allocatable :: resonant_terms(:)
      !> Index of the load of each of these terms
      integer, allocatable :: resonant_load(:)
      !> Integrals of the products of these terms, the harmonics and a constant; empty: not requested yet
      type(power_form_t) :: products
      !> Whether, with closed compliant contacts, a term hardly decays during a phase, so that sums of harmonics
      !> approximate the loads (module `surrogate_loads`); also true until this has been examined
      logical :: has_slow_terms = .true.
      !> Without closed compliant contacts: gaps as signals, whose state and load response the caller sets, [contacts]
      type(driven_signal_t), allocatable :: gap(:)
   end type unit_responses_t

   !> Load response during a phase.
   type :: forced_response_t
      !> tau at the start of the phase
      real(wp) :: tau = 0.0_wp
      !> Latest tau at the end of the phase
      real(wp) :: until = huge(1.0_wp)
      !> Segments of the loads, [loads]
      type(load_segment_t), allocatable :: segment(:)
      !> Constant of each row, [rows]
      real(wp), allocatable :: constant(:)
      !> Slope of each row, [rows]
      real(wp), allocatable :: slope(:)
      !> Harmonics of each row, [rows, harmonics]
      complex(wp), allocatable :: harmonic(:, :)
      !> Circular frequencies, [harmonics]
      real(wp), allocatable :: frequency(:)
      !> Modes driven from rest
      type(driven_mode_t), allocatable :: mode(:)
      !> Index of the entry of each of these modes in `unit_responses_t%driven`
      integer, allocatable :: pair(:)
   end type forced_response_t

contains

   !> Responses of a set of closed contacts to unit loads.
   subroutine make_unit_responses(beam, constrained, compliant, spring, loads, forced)
      type(free_beam_t), intent(in) :: beam
      type(constrained_set_t), intent(in) :: constrained
      !> Indices of the closed compliant contacts
      integer, intent(in) :: compliant(:)
      !> Dynamic stiffnesses of all contacts, [contacts]
      type(dynamic_stiffness_t), intent(in) :: spring(:)
      type(applied_loads_t), intent(in) :: loads
      type(unit_responses_t), intent(out) :: forced

      ! step of the complex-step derivative with respect to s, which has no cancellation error
      real(wp), parameter :: tiny_step = 1.0e-100_wp
      ! complex amplitude of each row under a unit load exp(s t), [rows]
      complex(wp), allocatable :: response(:)
      ! whether each mode vanishes at all compliant contacts, [modes]
      logical :: is_uncoupled(constrained%count)
      ! whether each mode is uncoupled and its stiffness hardly matters during a phase, [modes]
      logical :: is_slow(constrained%count)
      ! whether a harmonic load drives each mode from rest, [modes]
      logical :: is_driven(constrained%count)
      ! number of contacts, and number of loads
      integer :: contacts, total
      integer :: g, i

      contacts = size(constrained%gap)
      total = loads%count
      forced%has_slow_terms = size(compliant) > 0
      forced%at%gaps = constrained%count
      forced%at%forces = forced%at%gaps + contacts
      forced%at%indentations = forced%at%forces + contacts
      forced%at%branches = forced%at%indentations + contacts
      forced%at%tip = forced%at%branches + contacts
      forced%at%loads = forced%at%tip + 1
      forced%at%rows = forced%at%loads + total
      associate (rows => forced%at%rows)
         allocate (forced%constant(rows, total), forced%ramp(rows, total), source=0.0_wp)
         allocate (forced%harmonic(rows, total), source=(0.0_wp, 0.0_wp))
         allocate (response(rows))
      end associate
      if (allocated(constrained%mode)) then
         allocate (forced%load, source=matmul(transpose(constrained%mode), loads%mode))
      else
         allocate (forced%load, source=loads%mode)
      end if
      allocate (forced%adjoint(constrained%count, total), source=(0.0_wp, 0.0_wp))
      call balance_loads(beam, constrained, loads, forced)
      allocate (forced%driven(0))
      is_uncoupled = .not. maxval(abs(constrained%value(:, compliant)), dim=2) > 0.0_wp
      associate (n => constrained%count, oscillators => constrained%oscillators)
         is_slow = is_uncoupled .and. are_slow(loads, oscillators%square(:n), &
            oscillators%two_zeta*oscillators%square(:n) + oscillators%mass_rate(:n))
      end associate
      do i = 1, constrained%count
         if (is_slow(i)) call add_driven(constrained, i, by_constant, 0, forced)
         if (is_slow(i)) call add_driven(constrained, i, by_slope, 0, forced)
      end do
      do g = 1, total
         call response_at(constrained, compliant, spring, forced, g, cmplx(0.0_wp, tiny_step, wp), is_slow, response)
         forced%constant(:, g) = real(response, wp)
         forced%ramp(:, g) = aimag(response)/tiny_step
         if (loads%frequency(g) <= 0.0_wp) cycle
         is_driven = (is_uncoupled .and. resonates(constrained%oscillators, loads%frequency(g))) .or. &
            (is_slow .and. is_slow_load(loads, g))
         do i = 1, constrained%count
            if (is_driven(i)) call add_driven(constrained, i, by_harmonic, g, forced)
         end do
         call response_at(constrained, compliant, spring, forced, g, cmplx(0.0_wp, loads%frequency(g), wp), is_driven, &
            response)
         forced%harmonic(:, g) = response
         forced%adjoint(:, g) = adjoint_of(constrained%oscillators, forced%load(:, g), loads%frequency(g), is_driven)
      end do
      if (size(compliant) > 0) return
      allocate (forced%gap(contacts))
      do i = 1, contacts
         allocate (forced%gap(i)%free, source=constrained%gap(i))
      end do
   end subroutine make_unit_responses

   !> Find the parts of unit loads that go directly into the reactions of the closed rigid contacts, and subtract them
   !> from the modal loads.
   pure subroutine balance_loads(beam, constrained, loads, forced)
      type(free_beam_t), intent(in) :: beam
      type(constrained_set_t), intent(in) :: constrained
      type(applied_loads_t), intent(in) :: loads
      type(unit_responses_t), intent(inout) :: forced

      ! acceleration at each closed rigid contact by a unit reaction at each of them, [closed, closed]
      real(wp) :: mobility(size(constrained%closed), size(constrained%closed))
      integer :: g, i

      do i = 1, size(constrained%closed)
         mobility(:, i) = [(sum(beam%value(:, constrained%closed(g))*beam%value(:, constrained%closed(i))), g=1, &
            size(constrained%closed))]
      end do
      allocate (forced%balanced_fraction(size(constrained%closed), loads%count), source=0.0_wp)
      do g = 1, loads%count
         if (size(constrained%closed) == 0) exit
         call solve_active(mobility, -matmul(loads%mode(:, g), beam%value(:, constrained%closed)), &
            spread(.true., 1, size(constrained%closed)), forced%balanced_fraction(:, g))
         call drop_balanced(beam%value(:, constrained%closed), loads%mode(:, g), forced%balanced_fraction(:, g), &
            forced%load(:, g))
      end do
   end subroutine balance_loads

   !> Add a mode driven from rest, which the response to a load leaves out.
   subroutine add_driven(constrained, mode, part, load, forced)
      type(constrained_set_t), intent(in) :: constrained
      integer, intent(in) :: mode
      !> Part of the load, one of the `by_` constants
      integer, intent(in) :: part
      !> Index of the load; 0: all loads
      integer, intent(in) :: load
      type(unit_responses_t), intent(inout) :: forced

      type(mode_from_rest_t) :: pair
      integer :: place

      pair%mode = mode
      pair%part = part
      pair%load = load
      allocate (pair%row(forced%at%rows), pair%row_of_rate(forced%at%rows), source=0.0_wp)
      associate (at => forced%at, contacts => size(constrained%gap))
         pair%row(at%modes + mode) = 1.0_wp
         pair%row(at%gaps + 1:at%gaps + contacts) = constrained%value(mode, :)
         do place = 1, size(constrained%closed)
            pair%row(at%forces + constrained%closed(place)) = constrained%reaction(place, mode)
            pair%row_of_rate(at%forces &
               + constrained%closed(place)) = constrained%oscillators%two_zeta*constrained%reaction(place, mode)
         end do
         pair%row(at%tip + 1) = constrained%tip_value(mode)
         pair%row(at%loads + 1:) = forced%load(mode, :)
      end associate
      forced%driven = [forced%driven, pair]
   end subroutine add_driven

   !> Response of the rows to a unit load exp(s t).
   pure subroutine response_at(constrained, compliant, spring, forced, load, s, left_out, response)
      type(constrained_set_t), intent(in) :: constrained
      integer, intent(in) :: compliant(:)
      type(dynamic_stiffness_t), intent(in) :: spring(:)
      !> Indices of the rows, and modal loads of the set
      type(unit_responses_t), intent(in) :: forced
      integer, intent(in) :: load
      complex(wp), intent(in) :: s
      !> Whether a mode has no response, because it is driven from rest, [modes]
      logical, intent(in) :: left_out(:)
      !> Complex amplitudes of the rows, [rows]
      complex(wp), intent(out) :: response(:)

      ! of each mode: viscous = 1 + 2 zeta s; dynamic stiffness s^2 + alpha s + viscous W^2, [modes]
      complex(wp), dimension(constrained%count) :: viscous, dynamic
      ! amplitudes of the modal displacements, [modes]
      complex(wp) :: z(constrained%count)
      ! dynamic flexibility and force of each closed compliant contact, and a static gap of zero (`zero_gap`),
      ! [compliant]
      complex(wp), dimension(size(compliant)) :: flexibility, force, zero_gap
      integer :: k

      response = (0.0_wp, 0.0_wp)
      viscous = 1.0_wp + constrained%oscillators%two_zeta*s
      dynamic = s**2 + constrained%oscillators%mass_rate(:constrained%count)*s + viscous*constrained%oscillators%square
      ! in resonance it may be zero
      where (left_out) dynamic = 1.0_wp
      if (size(compliant) > 0) then
         zero_gap = (0.0_wp, 0.0_wp)
         flexibility = (0.0_wp, 0.0_wp)
         where (.not. is_rigid_stop(spring(compliant))) flexibility = 1.0_wp/dynamic_stiffness(spring(compliant), s)
         call find_point_forces(dynamic, constrained%value(:, compliant), flexibility, &
            cmplx(merge(0.0_wp, forced%load(:, load), left_out), 0.0_wp, wp), zero_gap, force, z)
      else
         z = (0.0_wp, 0.0_wp)
         where (.not. left_out) z = forced%load(:, load)/dynamic
      end if
      associate (at => forced%at)
         response(at%modes + 1:at%modes + constrained%count) = z
         response(at%gaps + 1:at%gaps + size(constrained%gap)) = matmul(z, constrained%value)
         do k = 1, size(constrained%closed)
            response(at%forces + constrained%closed(k)) = sum(constrained%reaction(k, :)*viscous*z) &
               - forced%balanced_fraction(k, load) &
               - sum(constrained%balanced_fraction(k, compliant)*force)
         end do
         do k = 1, size(compliant)
            associate (p => compliant(k), gap => response(at%gaps + compliant(k)))
               response(at%forces + p) = force(k)
               ! for a spring softer than the beam, with a strong damper, the derivative of this product with respect to
               ! s loses digits
               if (.not. abs(flexibility(k)) > sum(constrained%value(:, p)**2/constrained%oscillators%square)) gap = &
                  -force(k)*flexibility(k)
               if (is_rigid_stop(spring(p))) cycle
               response(at%indentations + p) = -gap
               response(at%branches + p) = -spring(p)%branch_stiffness*s/(s + spring(p)%relaxation_rate)*gap
            end associate
         end do
         response(at%tip + 1) = sum(constrained%tip_value*z)
         response(at%loads + 1:) = matmul(z, forced%load)
      end associate
   end subroutine response_at

   !> Start the load response of a phase at an instant.
   subroutine start_forced_response(set, oscillators, loads, tau, forced)
      type(unit_responses_t), intent(in) :: set
      !> Oscillators of the set
      type(oscillators_t), intent(in) :: oscillators
      type(applied_loads_t), intent(in) :: loads
      real(wp), intent(in) :: tau
      type(forced_response_t), intent(inout) :: forced

      integer :: g, i, m

      forced%tau = tau
      if (.not. allocated(forced%segment)) allocate (forced%segment(loads%count))
      forced%frequency = loads%frequencies
      do g = 1, loads%count
         forced%segment(g) = load_segment_at(loads%course(g), tau)
      end do
      forced%until = minval(forced%segment%until)
      if (allocated(forced%slope)) then
         if (size(forced%harmonic, 1) /= set%at%rows .or. size(forced%harmonic, 2) /= size(forced%frequency)) then
            deallocate (forced%constant, forced%slope, forced%harmonic)
         end if
      end if
      if (.not. allocated(forced%slope)) then
         allocate (forced%constant(set%at%rows), forced%slope(set%at%rows))
         allocate (forced%harmonic(set%at%rows, size(forced%frequency)))
      end if
      forced%constant(:) = 0.0_wp
      forced%slope(:) = 0.0_wp
      forced%harmonic(:, :) = (0.0_wp, 0.0_wp)
      do g = 1, loads%count
         associate (segment => forced%segment(g))
            if (abs(segment%constant) > 0.0_wp) forced%constant(:) = forced%constant + set%constant(:, &
               g)*segment%constant
            if (abs(segment%slope) > 0.0_wp) then
               forced%constant(:) = forced%constant + set%ramp(:, g)*segment%slope
               forced%slope(:) = forced%slope + set%constant(:, g)*segment%slope
            end if
            m = loads%harmonic(g)
            if (m == 0) cycle
            !$omp simd
            do i = 1, set%at%rows
               forced%harmonic(i, m) = forced%harmonic(i, m) + segment%harmonic*set%harmonic(i, g)
            end do
         end associate
      end do
      call start_modes(set, oscillators, forced)
   end subroutine start_forced_response

   !> Start the modes driven from rest.
   subroutine start_modes(set, oscillators, forced)
      type(unit_responses_t), intent(in) :: set
      !> Oscillators of the set
      type(oscillators_t), intent(in) :: oscillators
      !> Contains the load segments
      type(forced_response_t), intent(inout) :: forced

      ! complex amplitude of the modal load of each mode driven from rest
      complex(wp) :: force(size(set%driven))
      integer :: i

      if (size(set%driven) == 0 .and. allocated(forced%pair)) then
         if (size(forced%pair) == 0) return
      end if
      do i = 1, size(set%driven)
         associate (pair => set%driven(i), segment => forced%segment)
            select case (pair%part)
            case (by_constant)
               force(i) = sum(set%load(pair%mode, :)*segment%constant)
            case (by_slope)
               force(i) = sum(set%load(pair%mode, :)*segment%slope)
            case default
               force(i) = set%load(pair%mode, pair%load)*segment(pair%load)%harmonic
            end select
         end associate
      end do
      forced%pair = pack([(i, i=1, size(set%driven))], abs(force) > 0.0_wp)
      if (allocated(forced%mode)) deallocate (forced%mode)
      allocate (forced%mode(size(forced%pair)))
      do i = 1, size(forced%pair)
         associate (pair => set%driven(forced%pair(i)), mode => forced%mode(i))
            if (pair%part /= by_harmonic) then
               mode = make_driven_mode(oscillators, pair%mode, force(forced%pair(i)), is_ramp=pair%part == by_slope)
               cycle
            end if
            mode = make_driven_mode(oscillators, pair%mode, force(forced%pair(i)), forced%segment(pair%load)%frequency)
            forced%until = min(forced%until, forced%tau + max_periods*2.0_wp*pi/mode%frequency)
         end associate
      end do
   end subroutine start_modes

   !> Rows of the load response at a time since the start of the phase, and their rates.
   pure subroutine find_rows_at(set, forced, first, last, time, rows, rates, phasor)
      type(unit_responses_t), intent(in) :: set
      type(forced_response_t), intent(in) :: forced
      !> Index of the first row
      integer, intent(in) :: first
      !> Index of the last row
      integer, intent(in) :: last
      real(wp), intent(in) :: time
      !> Values of the rows, [last - first + 1]
      real(wp), contiguous, intent(out) :: rows(:)
      !> Rates of the rows, [last - first + 1]
      real(wp), contiguous, intent(out) :: rates(:)
      !> exp(i w t) if known already, [harmonics]
      complex(wp), intent(in), optional :: phasor(:)

      complex(wp) :: phasors(size(forced%frequency))
      real(wp) :: motion(0:2)
      integer :: i, m

      !$omp simd
      do i = 1, size(rows)
         rates(i) = forced%slope(first - 1 + i)
         rows(i) = forced%constant(first - 1 + i) + rates(i)*time
      end do
      if (present(phasor)) then
         phasors = phasor
      else
         phasors = phasor_of(forced%frequency, time)
      end if
      do m = 1, size(forced%frequency)
         call add_harmonic(forced%harmonic(first:last, m), forced%frequency(m), phasors(m), rows, rates)
      end do
      do m = 1, size(forced%pair)
         motion = driven_mode_at(forced%mode(m), time, 2)
         associate (pair => set%driven(forced%pair(m)))
            rows = rows + pair%row(first:last)*motion(0) + pair%row_of_rate(first:last)*motion(1)
            rates = rates + pair%row(first:last)*motion(1) + pair%row_of_rate(first:last)*motion(2)
         end associate
      end do
   end subroutine find_rows_at

   !> Add a harmonic with the phasor of the instant.
   pure subroutine add_harmonic(harmonic, frequency, phasor, rows, rates)
      complex(wp), contiguous, intent(in) :: harmonic(:)
      real(wp), intent(in) :: frequency
      complex(wp), intent(in) :: phasor
      !> Values to which the rows are added, [last - first + 1]
      real(wp), contiguous, intent(inout) :: rows(:)
      !> Rates to which the rates of the rows are added, [last - first + 1]
      real(wp), contiguous, intent(inout) :: rates(:)

      real(wp) :: cosine, even, odd, sine
      integer :: i

      cosine = real(phasor, wp)
      sine = aimag(phasor)
      !$omp simd private(even, odd)
      do i = 1, size(harmonic)
         even = real(harmonic(i), wp)
         odd = aimag(harmonic(i))
         rows(i) = rows(i) + (even*cosine - odd*sine)
         rates(i) = rates(i) - frequency*(even*sine + odd*cosine)
      end do
   end subroutine add_harmonic

end module forced_responses
