!> Beams and runs that the tests of exact motion share.
module exact_scenes
   use beam_mesh, only: make_mesh, mesh_t
   use beam_model, only: beam_model_t, make_beam_model
   use beam_section, only: tapered_section
   use contact_sets, only: contact_set_t, find_set, start_sets, set_store_t
   use damped_oscillators, only: make_oscillators
   use exact_motion, only: exact_response
   use failures, only: failure_t
   use constrained_sets, only: free_beam_t
   use coupled_modes, only: coupled_amplitudes
   use kinds, only: lambda1, wp
   use natural_solver, only: natural_modes
   use response_types, only: response_t
   use run_settings, only: output_settings_t, response_settings_t, run_settings_t, stop_settings_t
   use compliant_stop, only: dynamic_stiffness_t
   implicit none (type, external)
   private
   public :: model_for, beam_for, modal_beam_for, close_contact, amplitudes_from, flexibility_of
   public :: run_exact, energy_errors, height_ratio

   real(wp), parameter :: height_ratio = 0.075_wp

contains

   !> A beam on equal or graded elements.
   function model_for(elements, taper, tip_mass, position, ratio, is_redistributed) result(model)
      !> Number of elements
      integer, intent(in) :: elements
      !> s, mu, Lc/L
      real(wp), intent(in) :: taper
      real(wp), intent(in) :: tip_mass
      real(wp), intent(in) :: position
      !> Length of an element over that of the next towards the tip; default 1
      real(wp), intent(in), optional :: ratio
      !> Give the inertia of the stop's node to its neighbours; default false
      logical, intent(in), optional :: is_redistributed
      type(beam_model_t) :: model

      type(mesh_t) :: mesh
      type(failure_t), allocatable :: error
      real(wp) :: grading

      grading = 1.0_wp
      if (present(ratio)) grading = ratio
      call make_mesh(elements, grading, position, mesh, error)
      call make_beam_model(tapered_section(1.0_wp + taper, 1.0_wp - taper), mesh, tip_mass, model, &
         is_redistributed)
   end function model_for

   !> A beam with nodes at all stops of a run.
   function beam_for(settings, elements, tip_mass) result(model)
      type(run_settings_t), intent(in) :: settings
      integer, intent(in) :: elements
      real(wp), intent(in) :: tip_mass
      type(beam_model_t) :: model

      type(mesh_t) :: mesh
      type(failure_t), allocatable :: error
      real(wp), allocatable :: more(:)

      allocate (more(0))
      if (allocated(settings%more_stops)) more = settings%more_stops%position
      call make_mesh(elements, 1.0_wp, settings%stop%position, mesh, error, more)
      call make_beam_model(tapered_section(1.0_wp, 1.0_wp), mesh, tip_mass, model)
   end function beam_for

   !> The beam in its modes, with a stop below it where it is unstressed.
   function modal_beam_for(model, zeta) result(beam)
      !> The assembled beam
      type(beam_model_t), intent(in) :: model
      !> zeta
      real(wp), intent(in) :: zeta
      type(free_beam_t) :: beam

      type(failure_t), allocatable :: error
      real(wp), allocatable :: lambda(:), modes(:, :)

      call natural_modes(model, model%stiffness%order, lambda, error, modes)
      call make_oscillators((lambda/lambda1)**4, zeta, beam%oscillators)
      beam%value = reshape(modes(model%stop_dof, :), [size(lambda), 1])
      beam%tip_value = modes(model%tip_dof, :)
      beam%height = [0.0_wp]
      beam%tip_sign = [merge(1.0_wp, 0.0_wp, model%stop_dof == model%tip_dof)]
   end function modal_beam_for

   !> sum b_i^2/W_i^2: how far a unit force at the stop moves it.
   function flexibility_of(beam) result(flexibility)
      type(free_beam_t), intent(in) :: beam
      real(wp) :: flexibility

      flexibility = sum(beam%value(:, 1)**2/beam%oscillators%square)
   end function flexibility_of

   !> The beam on its stop, which yields.
   subroutine close_contact(beam, spring, store, set, error)
      type(free_beam_t), intent(in) :: beam
      class(dynamic_stiffness_t), intent(in) :: spring
      !> Keeps the set
      type(set_store_t), intent(inout) :: store
      type(contact_set_t), pointer, intent(out) :: set
      !> Set when the exponents are not found
      type(failure_t), allocatable, intent(out) :: error

      type(dynamic_stiffness_t) :: dynamic_stiffness
      logical :: is_new

      dynamic_stiffness = dynamic_stiffness_t(spring%stiffness, spring%branch_stiffness, spring%relaxation_rate, spring%viscosity)
      call start_sets(beam, [.false.], [dynamic_stiffness], store)
      call find_set([.true.], store, set, is_new, error)
   end subroutine close_contact

   !> Amplitudes of the terms of a contact, with their weights, from the state of the modes on an undeformed stop.
   function amplitudes_from(beam, set, q, v) result(amplitude)
      type(free_beam_t), intent(in) :: beam
      type(contact_set_t), intent(in) :: set
      !> [modes]
      real(wp), intent(in) :: q(:)
      real(wp), intent(in) :: v(:)
      complex(wp) :: amplitude(set%coupled%count)

      call coupled_amplitudes(beam%oscillators%square, set%coupled, beam%height, [0.0_wp], [0.0_wp], q, v, amplitude)
      amplitude = set%coupled%weight*amplitude
   end function amplitudes_from

   !> A run with the energy balance and measures.
   subroutine run_exact(model, zeta, stop_settings, response_settings, response, error)
      !> The assembled beam
      type(beam_model_t), intent(in) :: model
      !> zeta
      real(wp), intent(in) :: zeta
      !> Stop and run
      type(stop_settings_t), intent(in) :: stop_settings
      type(response_settings_t), intent(in) :: response_settings
      !> What came out
      type(response_t), intent(out) :: response
      type(failure_t), allocatable, intent(out) :: error

      type(output_settings_t) :: output

      output%energy = .true.
      output%measures = .true.
      call exact_response(model, run_settings_t(zeta, stop_settings, response_settings, output, height_ratio), &
         response, error)
   end subroutine run_exact

   !> By how much the energy balance of a run is open, and what beam and stop win from one sample to the next or by an event; shares
   !> of the energy at the start.
   pure function energy_errors(response) result(errors)
      !> A run with the energy balance
      type(response_t), intent(in) :: response
      real(wp) :: errors(2)

      real(wp), dimension(size(response%tau)) :: at_work, total
      integer :: last

      last = size(at_work)
      associate (e => response%energy)
         at_work = e%kinetic + e%strain + e%stop
         total = at_work + e%dissipated_beam + e%dissipated_stop + e%dissipated_impact - e%created
         errors = [maxval(abs(total - response%initial_energy)), &
            max(maxval(at_work(2:) - at_work(:last - 1)), maxval(e%created))]/response%initial_energy
      end associate
   end function energy_errors

end module exact_scenes
