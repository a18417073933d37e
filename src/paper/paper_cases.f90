!> The beams and stops of the figures of "the paper" (Irie, Yamada and Asano 1977), the variants in which their motion
!> is computed, and measures (scalar results) of a case in one variant. A variant is a method together with a mesh, a
!> kind of impulse and a mass matrix. The end of motion, of which the paper speaks without defining it, is measured by
!> six definitions: the last exceedance of a level by |eta_c|, the displacement at the stop, or by the energy above
!> rest, the energy that the motion can still lose.
module paper_cases
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use beam_mesh, only: make_mesh, mesh_t
   use beam_model, only: beam_model_t, make_beam_model
   use beam_section, only: section_t, tapered_section
   use failures, only: failure_t
   use free_modes, only: find_free_modes, free_modes_t
   use history_list, only: eta_stop, eta_tip, force_stop
   use kinds, only: pi, wp
   use mass_choice, only: is_redistribution_more_accurate
   use motion_run, only: run_motion
   use response_types, only: is_impact, response_t, run_measures_t
   use run_settings, only: output_settings_t, run_settings_t, impulse_momentum, impulse_nodal, law_restitution, &
      law_three_element, method_exact, method_newmark, stop_settings_t
   use skyline_matrix, only: multiply
   implicit none (type, external)
   private
   public :: outcome_t, find_outcome, end_levels, end_fractions, definition_count, displacement_end, energy_end, &
      never, or_nan, sample_step, paper_case_t, variant_t, height_ratio, make_variants, variant_count, coarse, fine, &
      coarse_nodal, paper_nodal, paper_momentum, comparison_variant

   !> Mean height hbar/L of the beam in all figures of the paper.
   real(wp), parameter :: height_ratio = 0.075_wp

   !> Variants of computing motion: exact motion on the coarse or fine mesh, and Newmark's method with the time step of
   !> the paper on the coarse mesh (`paper_`). In the variants with `_nodal` an impact replaces only the velocity of the
   !> node at the stop; in the other variants it applies an impulse to the whole beam.
   integer, parameter :: coarse = 1
   integer, parameter :: fine = 2
   integer, parameter :: coarse_nodal = 3
   integer, parameter :: fine_nodal = 4
   integer, parameter :: paper_nodal = 5
   integer, parameter :: paper_momentum = 6
   integer, parameter :: variant_count = 6
   !> For each variant, the variant with which its results are compared to estimate their error. Exact motion with
   !> impulses on the whole beam is compared with that on the other mesh (the fine mesh may have the redistributed mass
   !> matrix). Newmark's steps, and exact motion with replaced nodal velocities, are compared with the other integration
   !> method on the coarse mesh, because the motion under replaced nodal velocities depends strongly on the mesh
   !> (docs/theory.md, section 14). No variant is compared with `fine_nodal`, which is only listed in the results.
   integer, parameter :: comparison_variant(variant_count) = &
      [fine, coarse, paper_nodal, coarse_nodal, coarse_nodal, coarse]

   !> One curve of a figure. The defaults are the parameters of the paper's first example.
   type :: paper_case_t
      !> Taper alpha = (h0 - h1)/L at constant mean height
      real(wp) :: taper = 0.0_wp
      !> Tip mass mu
      real(wp) :: tip_mass = 0.0_wp
      !> Position Lc/L of the stop
      real(wp) :: position = 1.0_wp
      !> Damping ratio zeta
      real(wp) :: zeta = 1.0e-3_wp
      !> Coefficient of restitution eps
      real(wp) :: restitution = 0.6_wp
      !> Preload delta
      real(wp) :: preload = 0.0_wp
      !> Stiffness ratio kappa of the three-element stop; 0: the stop is rigid
      real(wp) :: stiffness = 0.0_wp
   end type paper_case_t

   !> A variant of computing motion: mesh, integration method, kind of impulse and mass matrix.
   type :: variant_t
      !> Name in tables
      character(24) :: name = ''
      !> Number of elements of equal length
      integer :: elements = 8
      !> `method_exact` or `method_newmark`
      integer :: method = method_exact
      !> `impulse_momentum` or `impulse_nodal`
      integer :: impulse = impulse_momentum
      !> True: use the more accurate of the consistent and the redistributed mass matrix; false: always use the
      !> consistent mass matrix of the paper. Replacement of nodal velocities has a meaning of its own only with the
      !> consistent one: with the redistributed one, both kinds of impulse are the same (docs/theory.md, section 14)
      logical :: chooses_mass_matrix = .false.
   end type variant_t

   !> Levels of |eta_c| whose last exceedance is the end of motion by the first three definitions.
   real(wp), parameter :: end_levels(3) = [0.05_wp, 0.02_wp, 0.01_wp]
   !> Fractions of the initial energy above rest; the last exceedance of each fraction is the end of motion by one of
   !> the last three definitions.
   real(wp), parameter :: end_fractions(3) = [0.05_wp, 0.01_wp, 0.002_wp]
   !> Index of a definition of the end that statements quote: |eta_c| last exceeds 2 percent.
   integer, parameter :: displacement_end = 2
   !> Index of the other definition that statements quote: 1 percent of the energy remains.
   integer, parameter :: energy_end = size(end_levels) + 2
   integer, parameter :: definition_count = size(end_levels) + size(end_fractions)

   !> Number of modes whose share of the energy is measured.
   integer, parameter :: measured_modes = 8

   !> Sampling interval in tau that determines the ends of motion, which is also the time step of the paper.
   real(wp), parameter :: sample_step = 0.01_wp

   !> Value of an instant of an event that does not happen within the run.
   real(wp), parameter :: never = 1.0e9_wp

   !> Value of eta below which a sample counts as time in contact.
   real(wp), parameter :: contact_level = 1.0e-3_wp

   !> Measures of one case in one variant.
   type :: outcome_t
      !> Instants tau of the end of motion by `end_levels`, then by `end_fractions`
      real(wp) :: end_tau(definition_count) = never
      !> Instant tau of the first impact
      real(wp) :: impact_tau = never
      !> Peaks eta of the rebounds
      real(wp), allocatable :: peak_eta(:)
      !> Instants of the peaks, tau
      real(wp), allocatable :: peak_tau(:)
      !> Maximum indentation of the stop in eta
      real(wp) :: indentation = 0.0_wp
      !> Whether there is a main rebound, the highest rebound within a period of the first mode after the first impact
      logical :: rebounds = .false.
      !> Peak of the main rebound in eta
      real(wp) :: main_peak = 0.0_wp
      !> Duration of the first closed contact, tau
      real(wp) :: contact_length = 0.0_wp
      !> Ratio of the time in contact to the time out of contact, from the first impact to the last exceedance of 2
      !> percent by eta_c
      real(wp) :: contact_ratio = 0.0_wp
      !> Energy lost at events until the peak of the main rebound, relative to the initial energy above rest
      real(wp) :: lost_before_peak = 0.0_wp
      !> Energy lost at impacts in the whole run, relative to the initial energy above rest
      real(wp) :: lost_at_impacts = 0.0_wp
      !> Energy created by replacing nodal velocities in the whole run, relative to the initial energy above rest
      real(wp) :: created = 0.0_wp
      !> Maximum velocity of approach in impacts after the main rebound
      real(wp) :: later_velocity = 0.0_wp
      !> Fraction of the energy in each of the lowest modes, shortly after the start of the main rebound
      real(wp) :: energy_fraction(measured_modes) = 0.0_wp
      !> Fraction of the modes above the second in the sum of all modal amplitudes of the displacement at the stop,
      !> shortly after the start of the main rebound
      real(wp) :: high_mode_displacement = 0.0_wp
      !> The same fraction for the velocity at the stop
      real(wp) :: high_mode_velocity = 0.0_wp
      !> Lowest frequency of the beam with its tip mass, in omega1
      real(wp) :: lowest_frequency = 1.0_wp
      !> Inverse of the effective mass at the stop in an impact, in 1/(rho Abar L)
      real(wp) :: inverse_mass = 0.0_wp
      !> Kinetic energy before the first impact, relative to the initial energy above rest
      real(wp) :: kinetic_at_impact = 0.0_wp
   end type outcome_t

contains

   !> Compute the motion of a case and its measures.
   subroutine find_outcome(this, variant, duration, outcome, error)
      type(paper_case_t), intent(in) :: this
      !> Variant of computing motion
      type(variant_t), intent(in) :: variant
      !> Duration of the run in tau
      real(wp), intent(in) :: duration
      !> Measures of the case
      type(outcome_t), intent(out) :: outcome
      !> Set if the run fails
      type(failure_t), allocatable, intent(out) :: error

      type(beam_model_t) :: model
      type(free_modes_t) :: modes
      type(response_t) :: response
      type(output_settings_t) :: output
      ! start of the main rebound, tau
      real(wp) :: rebound_start

      call model_of_case(this, variant, model, error)
      if (allocated(error)) return
      call find_free_modes(model, modes, error)
      if (allocated(error)) return
      output%history(eta_tip) = .false.
      output%history(force_stop) = .false.
      output%energy = .true.
      output%measures = .true.
      call run_case(this, variant, model, modes, duration, output, response, error)
      if (allocated(error)) return
      outcome%lowest_frequency = sqrt(modes%square(1))
      outcome%inverse_mass = sum(modes%mode(modes%stop_dof, :)**2)
      call measure(response, response%measures, outcome, rebound_start)
      if (.not. outcome%rebounds) return
      ! the shape is recorded one sampling interval after the release of the contact, when the highest modes no longer
      ! depend on the instant of the release
      output = output_settings_t(history=.false.)
      allocate (output%shape_times, source=[rebound_start + sample_step])
      call run_case(this, variant, model, modes, rebound_start + 0.05_wp, output, response, error)
      if (allocated(error)) return
      call measure_components(this, model, modes, response, outcome)
   end subroutine find_outcome

   !> Compute the motion of a case.
   subroutine run_case(this, variant, model, modes, duration, output, response, error)
      type(paper_case_t), intent(in) :: this
      !> Variant of computing motion
      type(variant_t), intent(in) :: variant
      !> Model of the beam
      type(beam_model_t), intent(in) :: model
      !> Free modes of the beam
      type(free_modes_t), intent(in) :: modes
      !> Duration of the run in tau
      real(wp), intent(in) :: duration
      !> Histories and shapes to record
      type(output_settings_t), intent(in) :: output
      type(response_t), intent(out) :: response
      !> Set if the run fails
      type(failure_t), allocatable, intent(out) :: error

      type(run_settings_t) :: settings

      ! the defaults, Newmark's beta = 1/4 and tolerances of 1e-4 and 1e-2, are those of the paper
      settings%zeta = this%zeta
      settings%stop = stop_of_case(this, variant%impulse)
      settings%response%duration = duration
      settings%response%step = sample_step
      settings%response%method = variant%method
      settings%response%keep_all_modes = .true.
      settings%output = output
      settings%height_ratio = height_ratio
      call run_motion(model, settings, response, error, modes)
   end subroutine run_case

   !> Compute the measures from histories and events.
   pure subroutine measure(response, measures, outcome, rebound_start)
      !> Motion of the case
      type(response_t), intent(in) :: response
      type(run_measures_t), intent(in) :: measures
      !> Measures of the case
      type(outcome_t), intent(inout) :: outcome
      !> Start of the main rebound in tau: the last event before its peak
      real(wp), intent(out) :: rebound_start

      ! initial energy above rest
      real(wp) :: initial_energy
      ! energy at rest on the stop
      real(wp) :: rest_energy
      ! kinetic energy at the last sample before the impact
      real(wp) :: kinetic_before
      ! index of the sample after the first impact
      integer :: first
      ! index of the last sample above a level
      integer :: last
      ! number of samples in contact
      integer :: closed_samples
      ! index of the main rebound among the peaks
      integer :: main
      integer :: i

      rebound_start = 0.0_wp
      allocate (outcome%peak_eta, source=measures%peak_eta)
      allocate (outcome%peak_tau, source=measures%peak_tau)
      rest_energy = measures%rest_energy
      initial_energy = measures%start_energy - rest_energy
      outcome%indentation = max(0.0_wp, -minval(response%history(eta_stop)%values))
      associate (eta => response%history(eta_stop)%values, tau => response%tau, energy => response%energy)
         do i = 1, size(end_levels)
            last = findloc(abs(eta) > end_levels(i), .true., dim=1, back=.true.)
            ! at the last sample the level is still exceeded: the end lies beyond the run (`never`)
            if (last < size(tau)) outcome%end_tau(i) = tau(last)
         end do
         do i = 1, size(end_fractions)
            last = findloc(energy%kinetic + energy%strain + energy%stop &
               - rest_energy > end_fractions(i)*initial_energy, .true., dim=1, back=.true.)
            if (last < size(tau)) outcome%end_tau(size(end_levels) + i) = tau(last)
         end do
         outcome%created = energy%created(size(tau))/initial_energy
         outcome%lost_at_impacts = energy%dissipated_impact(size(tau))/initial_energy
         if (.not. measures%has_hit_stop) return
         outcome%impact_tau = measures%first_impact_tau
         first = min(size(tau), 1 + count(tau < measures%first_impact_tau))
         kinetic_before = energy%kinetic(max(first - 1, 1))
         outcome%kinetic_at_impact = kinetic_before/initial_energy
         last = max(first, findloc(eta > end_levels(2), .true., dim=1, back=.true.))
         closed_samples = count(eta(first:last) < contact_level)
         outcome%contact_ratio = real(closed_samples, wp)/real(max(last - first + 1 - closed_samples, 1), wp)
      end associate
      if (size(measures%contact_start) > 0) outcome%contact_length = measures%contact_end(1) - measures%contact_start(1)
      associate (early => outcome%peak_tau < measures%first_impact_tau + 2.0_wp*pi/outcome%lowest_frequency)
         outcome%rebounds = any(early)
         if (.not. outcome%rebounds) return
         main = maxloc(outcome%peak_eta, dim=1, mask=early)
      end associate
      outcome%main_peak = outcome%peak_eta(main)
      do i = 1, response%event_count
         associate (event => response%events(i))
            if (event%tau <= outcome%peak_tau(main)) then
               rebound_start = event%tau
               outcome%lost_before_peak = outcome%lost_before_peak + max(0.0_wp, -event%energy_change)/initial_energy
            else if (is_impact(event)) then
               outcome%later_velocity = max(outcome%later_velocity, -event%velocity_before)
            end if
         end associate
      end do
   end subroutine measure

   !> Compute the contributions of the modes shortly after the start of the main rebound.
   pure subroutine measure_components(this, model, modes, response, outcome)
      type(paper_case_t), intent(in) :: this
      !> Model of the beam
      type(beam_model_t), intent(in) :: model
      !> Free modes of the beam
      type(free_modes_t), intent(in) :: modes
      !> Response with one recorded shape
      type(response_t), intent(in) :: response
      !> Measures of the case
      type(outcome_t), intent(inout) :: outcome

      ! displacements of the degrees of freedom
      real(wp) :: shape(2*model%mesh%elements)
      ! velocities of the degrees of freedom
      real(wp) :: velocity(2*model%mesh%elements)
      ! product of one of these vectors with the mass matrix
      real(wp) :: product(2*model%mesh%elements)
      ! modal displacements
      real(wp) :: q(2*model%mesh%elements)
      ! modal velocities
      real(wp) :: v(2*model%mesh%elements)
      ! modal energies
      real(wp) :: energy(2*model%mesh%elements)
      ! modal amplitudes at the stop
      real(wp) :: amplitude(2*model%mesh%elements)
      integer :: n

      ! shapes begin with index 0, the root, which has no degrees of freedom
      n = model%mesh%elements
      ! eta + delta is the displacement from the undeformed beam
      shape(1::2) = response%shape_displacement(1:n, 1) + this%preload
      shape(2::2) = response%shape_slope(1:n, 1)
      velocity(1::2) = response%shape_velocity(1:n, 1)
      velocity(2::2) = response%shape_slope_velocity(1:n, 1)
      call multiply(model%mass, shape, product)
      q = matmul(product, modes%mode)
      call multiply(model%mass, velocity, product)
      v = matmul(product, modes%mode)
      energy = 0.5_wp*(v**2 + modes%square*q**2)
      n = min(measured_modes, 2*n)
      outcome%energy_fraction(:n) = energy(:n)/sum(energy)
      amplitude = abs(modes%mode(modes%stop_dof, :))*sqrt(2.0_wp*energy/modes%square)
      outcome%high_mode_displacement = sum(amplitude(3:))/sum(amplitude)
      amplitude = amplitude*sqrt(modes%square)
      outcome%high_mode_velocity = sum(amplitude(3:))/sum(amplitude)
   end subroutine measure_components

   !> Make the variants, indexed by their constants.
   pure subroutine make_variants(coarse_elements, fine_elements, variants)
      !> Number of elements of the coarse mesh, the mesh of the paper
      integer, intent(in) :: coarse_elements
      !> Number of elements of the fine mesh
      integer, intent(in) :: fine_elements
      type(variant_t), intent(out) :: variants(variant_count)

      variants(coarse) = variant_t('exact, coarse', coarse_elements, method_exact, impulse_momentum)
      variants(fine) = variant_t('exact, fine', fine_elements, method_exact, impulse_momentum, &
         chooses_mass_matrix=.true.)
      variants(coarse_nodal) = variant_t('exact, coarse, nodal', coarse_elements, method_exact, impulse_nodal)
      variants(fine_nodal) = variant_t('exact, fine, nodal', fine_elements, method_exact, impulse_nodal)
      variants(paper_nodal) = variant_t("paper's steps, nodal", coarse_elements, method_newmark, impulse_nodal)
      variants(paper_momentum) = variant_t("paper's steps", coarse_elements, method_newmark, impulse_momentum)
   end subroutine make_variants

   !> The assembled beam of a case.
   pure subroutine model_of_case(this, variant, model, error)
      type(paper_case_t), intent(in) :: this
      !> Variant, which determines mesh and mass matrix
      type(variant_t), intent(in) :: variant
      type(beam_model_t), intent(out) :: model
      !> Set if the mesh cannot be made
      type(failure_t), allocatable, intent(out) :: error

      type(mesh_t) :: mesh
      type(section_t) :: section
      type(run_settings_t) :: settings
      logical :: is_redistributed

      call make_mesh(variant%elements, 1.0_wp, this%position, mesh, error)
      if (allocated(error)) return
      ! heights at root and tip, in L
      section = tapered_section(height_ratio + 0.5_wp*this%taper, max(height_ratio - 0.5_wp*this%taper, 0.0_wp))
      settings%stop = stop_of_case(this, variant%impulse)
      is_redistributed = variant%chooses_mass_matrix
      if (is_redistributed) is_redistributed = is_redistribution_more_accurate(section, mesh, this%tip_mass, settings)
      call make_beam_model(section, mesh, this%tip_mass, model, is_redistributed)
   end subroutine model_of_case

   !> The stop of a case. A three-element stop has beta = 20 and c* = 0.3 as in the paper.
   pure type(stop_settings_t) function stop_of_case(this, impulse) result(stop_settings)
      type(paper_case_t), intent(in) :: this
      !> Kind of the impulse, one of the `impulse_` constants
      integer, intent(in) :: impulse

      stop_settings%position = this%position
      stop_settings%preload = this%preload
      stop_settings%restitution = this%restitution
      stop_settings%impulse = impulse
      stop_settings%law = law_restitution
      if (this%stiffness > 0.0_wp) then
         stop_settings%law = law_three_element
         stop_settings%stiffness_ratio = this%stiffness
         stop_settings%branch_ratio = 20.0_wp
         stop_settings%damper_ratio = 0.3_wp
      end if
   end function stop_of_case

   !> An instant, or NaN for `never`.
   elemental real(wp) function or_nan(value) result(number)
      real(wp), intent(in) :: value

      number = value
      if (.not. value < never) number = ieee_value(1.0_wp, ieee_quiet_nan)
   end function or_nan

end module paper_cases
