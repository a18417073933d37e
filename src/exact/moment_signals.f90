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
   use constrained_sets, only: displacement_t
   use driven_signal, only: add_terms, driven_terms_t
   use exponential_signal, only: exponential_signal_t
   use free_modes, only: free_modes_t, max_rigid_square
   use kinds, only: wp
   use modal_signal, only: make_modal_signal, modal_signal_t, set_reaction_state
   use moment_places, only: find_place_weights, place_weights_t
   use phase_state, only: phase_state_t
   use run_recorder, only: sample_t
   use run_settings, only: run_settings_t
   use stop_contacts, only: contact_t
   use summed_signal, only: summed_signal_t
   implicit none (type, external)
   private
   public :: moments_t, make_moments, begin_moments, sample_moments, moment_row_t, find_row, find_load_terms

   !> Moment at one place of the beam as a function of time.
   type :: signal_place_t
      class(transformable_signal_t), allocatable :: signal
   end type signal_place_t

   !> Coefficients of the moment at a place, or of the displacement of a body, in the current phase.
   type :: moment_row_t
      !> Static moment with the closed rigid contacts
      real(wp) :: static = 0.0_wp
      !> Moment per unit of z + 2 zeta z' of each constrained mode; of a body, displacement per unit of z, [modes]
      real(wp), allocatable :: weight(:)
      !> Whether the modes enter by z + 2 zeta z' (a moment) instead of z (a displacement)
      logical :: is_viscous = .true.
      !> Moment per unit of the force of each compliant contact, [compliant]
      real(wp), allocatable :: force_moment(:)
      !> Moment per unit of each load while z + 2 zeta z' is constant, [loads]; unallocated: no loads
      real(wp), allocatable :: load_moment(:)
   end type moment_row_t

   !> Bending moments at the requested places.
   type :: moments_t
      !> Moment at each place per unit of modal displacement, [modes, places]
      real(wp), allocatable, private :: stiffness(:, :)
      !> Moment at each place per unit of modal acceleration, [modes, places]
      real(wp), allocatable, private :: mass(:, :)
      !> Moment per unit of each load: direct contribution and static response of truncated modes, [loads, places]
      real(wp), allocatable, private :: load(:, :)
      !> Moment per unit of contact force: static response of truncated modes, [contacts, places]
      real(wp), allocatable, private :: contact(:, :)
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

      type(place_weights_t) :: places
      real(wp), allocatable :: static(:, :)
      integer :: k

      call find_place_weights(model, settings, loads, places)
      associate (mode => modes%mode(:size(places%mass, 1), :))
         allocate (moments%stiffness, source=matmul(transpose(mode), places%stiffness))
         allocate (moments%mass, source=matmul(transpose(mode), places%mass))
      end associate
      call move_alloc(places%load, moments%load)
      allocate (moments%contact(size(contacts), size(settings%stress%position)), source=0.0_wp)
      allocate (moments%place(size(settings%stress%position)))
      if (.not. allocated(modes%truncated_mode)) return
      ! static response of truncated modes: moment at each place per unit of force on each degree of freedom
      allocate (static, source=matmul(modes%truncated_mode, matmul(transpose(modes%truncated_mode), places%stiffness) &
         /spread(modes%truncated_square, 2, size(settings%stress%position))))
      if (loads%count > 0) moments%load = moments%load + matmul(transpose(loads%vector(:size(static, 1), :)), static)
      do k = 1, size(contacts)
         if (contacts(k)%settings%is_of_base) cycle
         moments%contact(k, :) = contacts(k)%sign*static(model%stop_dofs(contacts(k)%stop), :)
      end do
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
      type(moment_row_t) :: row

      call find_row(moments, p, now, row)
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

   !> Find the coefficients of the moment at a place, or of the displacement of a body, in the current phase.
   pure subroutine find_row(moments, p, now, row)
      type(moments_t), intent(in) :: moments
      !> Index of the place, or the number of places plus the number of the body
      integer, intent(in) :: p
      type(phase_state_t), intent(in) :: now
      type(moment_row_t), intent(out) :: row

      ! moment per unit of modal force of each constrained mode
      real(wp), allocatable :: mass(:)
      integer :: places

      places = 0
      if (allocated(moments%place)) places = size(moments%place)
      if (p > places) then
         call find_displacement_row(now%beam%displacement(p - places), now, row)
         return
      end if
      associate (constrained => now%set%constrained, stiffness => moments%stiffness(:, p), &
         contact => moments%contact(:, p))
         row%static = sum(stiffness*constrained%static) + sum(contact(constrained%closed)*constrained%static_force)
         if (allocated(constrained%mode)) then
            allocate (mass, source=matmul(moments%mass(:, p), constrained%mode))
            allocate (row%weight, source=matmul(stiffness, constrained%mode) - constrained%oscillators%square*mass &
               + matmul(contact(constrained%closed), constrained%reaction))
         else
            allocate (mass, source=moments%mass(:, p))
            allocate (row%weight, source=stiffness - constrained%oscillators%square*mass)
         end if
         ! the rotation about a pinned root and free bodies cause no moment
         where (constrained%oscillators%square <= max_rigid_square) row%weight = 0.0_wp
         allocate (row%force_moment, source=force_moments(now, mass, contact))
      end associate
      if (now%loads%count == 0) return
      allocate (row%load_moment, source=moments%load(:, p) + matmul(mass, now%set%forced%load) &
         - matmul(moments%contact(now%set%constrained%closed, p), now%set%forced%balanced_fraction))
   end subroutine find_row

   !> Find the coefficients of a displacement in which one mode takes part, in the current phase.
   pure subroutine find_displacement_row(displacement, now, row)
      type(displacement_t), intent(in) :: displacement
      type(phase_state_t), intent(in) :: now
      type(moment_row_t), intent(out) :: row

      associate (constrained => now%set%constrained, i => displacement%mode, value => displacement%value)
         row%static = displacement%origin + value*constrained%static(i)
         if (allocated(constrained%mode)) then
            allocate (row%weight, source=value*constrained%mode(i, :))
         else
            allocate (row%weight(constrained%count), source=0.0_wp)
            row%weight(i) = value
         end if
      end associate
      row%is_viscous = .false.
      allocate (row%force_moment(size(now%set%compliant)), row%load_moment(now%loads%count), source=0.0_wp)
   end subroutine find_displacement_row

   !> Moment per unit of the force of each contact in `compliant`, [compliant].
   pure function force_moments(now, mass, contact) result(moment)
      type(phase_state_t), intent(in) :: now
      !> Moment per unit of modal force on each constrained mode, m, [modes]
      real(wp), intent(in) :: mass(:)
      !> Moment of the truncated modes per unit of contact force, [contacts]
      real(wp), intent(in) :: contact(:)
      real(wp) :: moment(size(now%set%compliant))

      integer :: m

      associate (constrained => now%set%constrained, compliant => now%set%compliant)
         do m = 1, size(compliant)
            moment(m) = sum(mass*constrained%value(:, compliant(m))) + contact(compliant(m)) &
               - sum(contact(constrained%closed)*constrained%balanced_fraction(:, compliant(m)))
         end do
      end associate
   end function force_moments

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
      type(moment_row_t), intent(in) :: row
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
