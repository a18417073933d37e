!> Bending moments at places along a beam with any number of contacts, as closed-form signals of each phase (the motion
!> between two events), for histories, and for extremes that need not lie at a sample (docs/theory.md, section 19).
!>
!> The moment at a place is k (z + 2 zeta z') + m (z'' + alpha z') summed over the modes z of the contact set (the beam
!> with its closed rigid contacts as constraints), plus the direct contribution of loads. Here k and m are the
!> components `stiffness` and `mass` of `moments_t`, alpha is the rate of mass-proportional damping, and ' is d/dtau.
!> The equation of motion replaces z'' + alpha z' by the modal force minus W^2 (z + 2 zeta z'). So the moment is the sum
!> of the static moment, of (k - W^2 m) (z + 2 zeta z') over the modes, of m times the modal forces of compliant
!> contacts and loads, and of the direct contribution of loads. Truncated modes respond statically to all forces, also
!> to the reactions of closed rigid contacts, which a unit force reduces at once by its `balanced_fraction`.
module moment_signals
   use applied_loads, only: applied_loads_t
   use beam_model, only: beam_model_t
   use certified_search, only: transformable_signal_t
   use driven_signal, only: add_terms, driven_terms_t
   use exponential_signal, only: exponential_signal_t
   use free_modes, only: free_modes_t, max_rigid_square
   use kinds, only: wp
   use modal_signal, only: make_modal_signal, modal_signal_t, set_reaction_state
   use moment_places, only: find_place_weights, place_weights_t, take_modes
   use phase_state, only: phase_state_t
   use run_recorder, only: sample_t
   use run_settings, only: run_settings_t
   use stop_contacts, only: contact_t
   use summed_signal, only: summed_signal_t
   implicit none (type, external)
   private
   public :: moments_t, make_moments, begin_moments, sample_moments, motion_row_t, find_row, find_load_terms

   !> Moment at one place of the beam as a function of time.
   type :: signal_place_t
      class(transformable_signal_t), allocatable :: signal
   end type signal_place_t

   !> Coefficients of a row in the current phase: a displacement, a contact force or a bending moment.
   type :: motion_row_t
      !> Value in static equilibrium with the closed rigid contacts
      real(wp) :: static = 0.0_wp
      !> Value per unit of z + 2 zeta z' of each constrained mode; of a displacement, per unit of z, [modes]
      real(wp), allocatable :: weight(:)
      !> Whether the modes enter by z + 2 zeta z' (a force or a moment) instead of z (a displacement)
      logical :: is_viscous = .true.
      !> Value per unit of the force of each compliant contact besides the motion of the modes, [compliant]
      real(wp), allocatable :: force_moment(:)
      !> Value per unit of each load while z + 2 zeta z' is constant, [loads]; unallocated: no loads
      real(wp), allocatable :: load_moment(:)
   end type motion_row_t

   !> Bending moments at the requested places: weights of the free modes, of loads and of contact forces.
   type, extends(place_weights_t) :: moments_t
      !> Moments as signals of the present phase, [places]; unallocated: no moments are requested
      type(signal_place_t), allocatable :: place(:)
   end type moments_t

contains

   !> Set up the moments of all places in the free modes.
   subroutine make_moments(model, modes, settings, contacts, loads, moments)
      type(beam_model_t), intent(in) :: model
      type(free_modes_t), intent(in) :: modes
      !> Settings that request moments
      type(run_settings_t), intent(in) :: settings
      type(contact_t), intent(in) :: contacts(:)
      type(applied_loads_t), intent(in) :: loads
      type(moments_t), intent(out) :: moments

      call find_place_weights(model, settings, loads, moments%place_weights_t)
      call take_modes(model, modes, contacts, loads, moments%place_weights_t)
      allocate (moments%place(size(settings%stress%position)))
   end subroutine make_moments

   !> Set up the signals of a phase at its start.
   subroutine begin_moments(moments, now)
      type(moments_t), intent(inout) :: moments
      type(phase_state_t), intent(in) :: now

      integer :: p

      if (.not. allocated(moments%place)) return
      do p = 1, size(moments%place)
         call find_signal(moments, p, now, moments%place(p)%signal)
      end do
   end subroutine begin_moments

   !> Evaluate the moments of a sample.
   subroutine sample_moments(moments, time, sample)
      type(moments_t), intent(in) :: moments
      !> Time since the start of the phase
      real(wp), intent(in) :: time
      type(sample_t), intent(inout) :: sample

      real(wp) :: rate
      integer :: p

      if (.not. allocated(moments%place)) return
      if (.not. allocated(sample%moment)) allocate (sample%moment(size(moments%place)))
      do p = 1, size(moments%place)
         call moments%place(p)%signal%evaluate(time, sample%moment(p), rate)
      end do
   end subroutine sample_moments

   !> Find the moment at a place as a signal of the present phase.
   subroutine find_signal(moments, p, now, signal)
      type(moments_t), intent(in) :: moments
      !> Index of the place
      integer, intent(in) :: p
      type(phase_state_t), intent(in) :: now
      class(transformable_signal_t), allocatable, intent(out) :: signal

      type(modal_signal_t), allocatable :: modal
      type(driven_terms_t) :: terms
      type(motion_row_t) :: row

      call find_row(moments, 2*size(now%states) + 1 + p, now, row)
      if (size(now%set%compliant) > 0) then
         call make_compliant_signal(now, row%static, row%weight, row%force_moment, signal)
      else
         allocate (modal)
         call make_modal_signal(now%set%constrained%oscillators, row%static, row%weight, modal)
         ! a signal of z + 2 zeta z'
         modal%is_viscous = .true.
         call set_reaction_state(now%z, now%v, modal)
         call move_alloc(modal, signal)
      end if
      if (now%loads%count == 0) return
      call find_load_terms(now, row, terms)
      call add_terms(terms, now%max_length, signal)
   end subroutine find_signal

   !> Find the coefficients of a row in the current phase. With n contacts, rows 1 to n are the displacements s y at the
   !> contacts (s = 1 for a contact below the beam, -1 above), row n + 1 is the displacement of the tip, rows n + 2 to
   !> 2 n + 1 are contact forces, and the others are bending moments and then displacements
   !> of recorded points.
   pure subroutine find_row(moments, number, now, row)
      type(moments_t), intent(in) :: moments
      !> Number of the row
      integer, intent(in) :: number
      type(phase_state_t), intent(in) :: now
      type(motion_row_t), intent(out) :: row

      ! value per unit of displacement of each free mode, and of modal force on each mode of the set
      real(wp), allocatable :: stiffness(:), mass(:)
      ! value per unit of each contact force, besides the motion of the modes
      real(wp) :: contact(size(now%states))
      integer :: m, p, places

      places = 0
      if (allocated(moments%place)) places = size(moments%place)
      ! number of the place; below 1: the row is no moment
      p = number - (2*size(contact) + 1)
      if (p > places .or. number <= size(contact) + 1) then
         call find_displacement_row(number, p - places, now, row)
         return
      end if
      associate (constrained => now%set%constrained)
         allocate (stiffness(size(constrained%static)), mass(size(constrained%static)), source=0.0_wp)
         contact = 0.0_wp
         if (p > 0) then
            stiffness = moments%stiffness(:, p)
            mass = moments%mass(:, p)
            contact = moments%contact(:, p)
         else
            contact(number - size(contact) - 1) = 1.0_wp
         end if
         row%static = sum(stiffness*constrained%static) + sum(contact(constrained%closed)*constrained%static_force)
         if (allocated(constrained%mode)) then
            mass = matmul(mass, constrained%mode)
            row%weight = matmul(stiffness, constrained%mode) - constrained%oscillators%square*mass &
               + matmul(contact(constrained%closed), constrained%reaction)
         else
            row%weight = stiffness - constrained%oscillators%square*mass
         end if
         ! the rotation about a pinned root and other motions without strain cause no moment
         if (p > 0) then
            where (constrained%oscillators%square <= max_rigid_square) row%weight = 0.0_wp
         end if
         associate (compliant => now%set%compliant)
            row%force_moment = [(sum(mass*constrained%value(:, compliant(m))) + contact(compliant(m)) &
               - sum(contact(constrained%closed)*constrained%balanced_fraction(:, compliant(m))), m=1, size(compliant))]
         end associate
         if (now%loads%count == 0) return
         row%load_moment = matmul(mass, now%set%forced%load) - matmul(contact(constrained%closed), &
            now%set%forced%balanced_fraction)
         if (p > 0) row%load_moment = row%load_moment + moments%load(:, p)
      end associate
   end subroutine find_row

   !> Find the coefficients of a displacement in the current phase: at a contact, of the tip or of a
   !> recorded point.
   pure subroutine find_displacement_row(number, point, now, row)
      !> Number of the row
      integer, intent(in) :: number
      !> Index of the recorded point; below 1: the displacement is one of the beam
      integer, intent(in) :: point
      type(phase_state_t), intent(in) :: now
      type(motion_row_t), intent(out) :: row

      associate (constrained => now%set%constrained)
         if (point > 0) then
            ! a single free mode takes part
            associate (i => now%beam%displacement(point)%mode, value => now%beam%displacement(point)%value)
               row%static = now%beam%displacement(point)%origin + value*constrained%static(i)
               allocate (row%weight(constrained%count), source=0.0_wp)
               if (allocated(constrained%mode)) row%weight = value*constrained%mode(i, :)
               if (.not. allocated(constrained%mode)) row%weight(i) = value
            end associate
         else if (number > size(now%states)) then
            row%static = constrained%static_tip
            row%weight = constrained%tip_value
         else
            row%static = constrained%static_gap(number) + now%beam%observed_height(number)
            row%weight = constrained%value(:, number)
         end if
      end associate
      row%is_viscous = .false.
      allocate (row%force_moment(size(now%set%compliant)), row%load_moment(now%loads%count), source=0.0_wp)
   end subroutine find_displacement_row

   !> The moment with closed compliant contacts, without the load response.
   subroutine make_compliant_signal(now, static, weight, force_moment, signal)
      type(phase_state_t), intent(in) :: now
      !> Moment in static equilibrium of the constrained beam, without compliant contacts
      real(wp), intent(in) :: static
      !> Moment per unit of z + 2 zeta z' of each constrained mode, [modes]
      real(wp), intent(in) :: weight(:)
      !> Moment per unit of the force of each compliant contact, [compliant]
      real(wp), intent(in) :: force_moment(:)
      class(transformable_signal_t), allocatable, intent(out) :: signal

      type(exponential_signal_t), allocatable :: exponential
      type(summed_signal_t), allocatable :: total
      type(modal_signal_t), allocatable :: uncoupled
      real(wp) :: uncoupled_weight(size(weight))
      integer :: m

      associate (set => now%set, coupled => now%set%coupled, oscillators => now%set%constrained%oscillators)
         allocate (exponential)
         exponential%offset = static + sum(weight*set%rest_modes) + sum(force_moment*set%rest_force)
         allocate (exponential%exponent, source=coupled%exponent)
         allocate (exponential%amplitude, source=[(now%amplitude(m)*((1.0_wp + oscillators%two_zeta &
            *coupled%exponent(m))*sum(weight*coupled%shape(:, m)) + sum(force_moment*coupled%force(:, m))), m=1, &
            coupled%count)])
         if (size(coupled%inactive) == 0) then
            call move_alloc(exponential, signal)
            return
         end if
         ! modes that vanish at all compliant contacts are uncoupled
         uncoupled_weight = 0.0_wp
         uncoupled_weight(coupled%inactive) = weight(coupled%inactive)
         allocate (uncoupled)
         call make_modal_signal(oscillators, 0.0_wp, uncoupled_weight, uncoupled)
         uncoupled%is_viscous = .true.
         call set_reaction_state(now%z, now%v, uncoupled)
         allocate (total)
         call move_alloc(exponential, total%first)
         call move_alloc(uncoupled, total%second)
         call move_alloc(total, signal)
      end associate
   end subroutine make_compliant_signal

   !> Find the contribution of the load response to the moment.
   pure subroutine find_load_terms(now, row, terms)
      type(phase_state_t), intent(in) :: now
      type(motion_row_t), intent(in) :: row
      type(driven_terms_t), intent(out) :: terms

      complex(wp) :: s
      real(wp) :: two_zeta
      integer :: g, i, m

      two_zeta = merge(now%set%constrained%oscillators%two_zeta, 0.0_wp, row%is_viscous)
      associate (set => now%set, at => now%set%forced%at, forced => now%forced, &
         weight => row%weight, force_moment => row%force_moment, &
         load_moment => row%load_moment)
         associate (modes => forced%constant(at%modes + 1:at%gaps), slopes => forced%slope(at%modes + 1:at%gaps))
            terms%constant = sum(weight*(modes + two_zeta*slopes)) + sum(load_moment*forced%segment%constant) &
               + sum(force_moment*forced%constant(at%forces + set%compliant))
            terms%slope = sum(weight*slopes) + sum(load_moment*forced%segment%slope) &
               + sum(force_moment*forced%slope(at%forces + set%compliant))
         end associate
         allocate (terms%frequency, source=forced%frequency)
         allocate (terms%harmonic(size(forced%frequency)))
         do m = 1, size(forced%frequency)
            s = cmplx(0.0_wp, forced%frequency(m), wp)
            terms%harmonic(m) = (1.0_wp + two_zeta*s)*sum(weight*forced%harmonic(at%modes + 1:at%gaps, m)) &
               + sum(force_moment*forced%harmonic(at%forces + set%compliant, m))
         end do
         do g = 1, now%loads%count
            m = now%loads%harmonic(g)
            if (m > 0) terms%harmonic(m) = terms%harmonic(m) + load_moment(g)*forced%segment(g)%harmonic
         end do
         terms%modes = size(forced%pair)
         if (terms%modes == 0) return
         allocate (terms%mode, source=forced%mode)
         allocate (terms%weight, source=[(weight(set%forced%driven(forced%pair(i))%mode), i=1, size(forced%pair))])
         allocate (terms%weight_of_rate, source=two_zeta*terms%weight)
      end associate
   end subroutine find_load_terms

end module moment_signals
