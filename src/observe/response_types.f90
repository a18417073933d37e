!> What a run through time leaves behind: events, histories at equal steps, shapes, energies. Both
!> methods (`newmark`, `exact`) fill it; measures, files and tables read it.
!>
!> Scales as everywhere behind the scene (docs/theory.md, section 2): displacement eta = (y - d)/(y_c(0) - d), time
!> tau = omega1 t, mass in rho Abar L; so energies come in rho Abar L omega1^2 (y_c(0) - d)^2, impulses in
!> rho Abar L omega1 (y_c(0) - d), and forces as Pbar of the paper.
module response_types
   use history_list, only: history_count
   use kinds, only: i8, wp
   use section_types, only: run_sections_t
   use signal_peaks, only: extreme_search_t, peak_tolerance
   use statistic_types, only: run_statistics_t
   implicit none (type, external)
   private
   public :: response_t, event_t, contact_record_t, moment_record_t, append_event, event_names
   public :: event_impact, event_capture, event_release, event_contact, event_separation, event_closed_impulse
   public :: is_contact_start, is_contact_end, miss_of_energies
   public :: mode_check_t, mesh_check_t, run_measures_t, settling_level, settled_energy

   !> Model A: the stop point hits the stop and rebounds.
   integer, parameter :: event_impact = 1
   !> Model A: the stop point comes to rest on the stop and is held, or released at once if that would have to pull.
   integer, parameter :: event_capture = 2
   !> Model A: the held stop point leaves.
   integer, parameter :: event_release = 3
   !> Model B: contact begins.
   integer, parameter :: event_contact = 4
   !> Model B: contact ends.
   integer, parameter :: event_separation = 5
   !> Model A: a stop that holds the stop point takes an impulse as another is hit.
   integer, parameter :: event_closed_impulse = 6
   !> The constants above in words.
   character(*), parameter :: event_names(6) = [character(10) :: 'impact', 'capture', 'release', 'contact', &
      'separation', 'blow']

   !> The stop point is quiet while |eta_c| stays within this; a flight that rises above it is a rebound.
   real(wp), parameter :: settling_level = 0.02_wp
   !> The energy is spent when no more than this share of it is left above that at rest.
   real(wp), parameter :: settled_energy = 0.01_wp

   type :: event_t
      !> Instant
      real(wp) :: tau = 0.0_wp
      !> One of the `event_` constants
      integer :: kind = 0
      !> eta of the stop point
      real(wp) :: eta = 0.0_wp
      !> d eta / d tau of the stop point before and after
      real(wp) :: velocity_before = 0.0_wp
      real(wp) :: velocity_after = 0.0_wp
      !> Impulse on the beam, >= 0 away from the stop
      real(wp) :: impulse = 0.0_wp
      !> Change of the beam's energy at the event
      real(wp) :: energy_change = 0.0_wp
      !> Which surface of those of all stops, in the scene's order, below before above
      integer :: contact = 1
   end type event_t

   !> The ledger at the sample times. Kinetic + strain + stop + dissipated_* - created - work is constant.
   type :: energy_t
      !> Kinetic energy of beam and tip mass; of Newmark's steps with their mass M*
      real(wp), allocatable :: kinetic(:)
      !> Strain energy of the beam
      real(wp), allocatable :: strain(:)
      !> Energy in the springs of the stop
      real(wp), allocatable :: stop(:)
      !> Dissipated so far: inside the beam (with gamma > 1/2 by Newmark's steps too), in the stop, at impacts
      real(wp), allocatable :: dissipated_beam(:)
      real(wp), allocatable :: dissipated_stop(:)
      real(wp), allocatable :: dissipated_impact(:)
      !> Created so far by the nodal reading of the impulse
      real(wp), allocatable :: created(:)
      !> Work of forces and of the base so far; unallocated: there are none
      real(wp), allocatable :: work(:)
   end type energy_t

   !> What engineers ask of a run: how soon, how hard, how long, how high again, when quiet. From phases or steps and
   !> from events, never from samples, so that it does not depend on what is kept.
   type :: run_measures_t
      !> Length of the run, tau
      real(wp) :: duration = 0.0_wp
      !> Impacts of model A, or contacts of model B
      integer :: impacts = 0
      !> Contacts that last: capture to release, contact to separation, or to the end of the run
      real(wp), allocatable :: contact_start(:)
      real(wp), allocatable :: contact_end(:)
      !> Time of the first meeting with the stop, and d eta/d tau before it; meaningless without any
      logical :: has_met_stop = .false.
      real(wp) :: first_impact_tau = 0.0_wp
      real(wp) :: first_impact_velocity = 0.0_wp
      !> Longest and total time in contact
      real(wp) :: longest_contact = 0.0_wp
      real(wp) :: total_contact = 0.0_wp
      !> What peaks and extremes of moments and statistics may be short by, a share of themselves
      real(wp) :: extremes_tolerance = peak_tolerance
      !> Greatest contact force, as Pbar; of model A the greatest mean over `force_window` from the beginning of an
      !> episode
      real(wp) :: greatest_force = 0.0_wp
      !> Greatest impulse of an episode, less that of the force at rest in its contacts
      real(wp) :: greatest_impulse = 0.0_wp
      !> Number of rebounds, and the highest point of each, or of the first of them
      integer :: rebounds = 0
      real(wp), allocatable :: peak_eta(:)
      real(wp), allocatable :: peak_tau(:)
      !> When |eta_c| last exceeded `settling_level`; false: at the end it still does
      logical :: has_settled = .false.
      real(wp) :: settling_tau = 0.0_wp
      !> When the energy above that of the beam at rest last exceeded `settled_energy` of the start's; false: it still
      !> does
      logical :: has_spent = .false.
      real(wp) :: spent_tau = 0.0_wp
      !> Energy at the start, of the beam at rest, and at the end
      real(wp) :: start_energy = 0.0_wp
      real(wp) :: rest_energy = 0.0_wp
      real(wp) :: final_energy = 0.0_wp
      !> Shares of the start's energy above rest: dissipated in the beam, in the stop, at impacts; created by the nodal
      !> reading of the impulse; left at the end
      real(wp) :: lost_beam = 0.0_wp
      real(wp) :: lost_stop = 0.0_wp
      real(wp) :: lost_impact = 0.0_wp
      real(wp) :: created = 0.0_wp
      real(wp) :: left = 0.0_wp
      !> Of all places where they are asked for: the greatest moment and stress in magnitude, when and where that stress
      !> is, and the widest range of stress of one of them
      logical :: has_moment = .false.
      real(wp) :: greatest_moment = 0.0_wp
      logical :: has_stress = .false.
      real(wp) :: greatest_stress = 0.0_wp
      real(wp) :: greatest_stress_tau = 0.0_wp
      real(wp) :: greatest_stress_position = 0.0_wp
      real(wp) :: stress_range = 0.0_wp
      !> Elements of the mesh
      integer :: mesh_elements = 0
      !> Statistics of all surfaces together, [statistic_count]; unallocated: not asked for
      real(wp), allocatable :: statistics(:)
      !> From sections, if they are asked for
      logical :: has_sections = .false.
      integer :: motion_period = 0
      real(wp) :: impacts_per_period = 0.0_wp
      real(wp) :: lyapunov_exponent = 0.0_wp
   end type run_measures_t

   !> How many modes a run kept, and what the trials found from which that number follows.
   type :: mode_check_t
      !> Kept, of all that the mesh has
      integer :: kept = 0
      integer :: all_modes = 0
      !> So many more had the trial that was compared with one in those kept; 0: none was
      integer :: compared = 0
      !> Up to here both were compared, tau, and their greatest difference in eta of stops and tip
      real(wp) :: horizon = 0.0_wp
      real(wp) :: difference = 0.0_wp
      !> What was asked for, in eta, and whether the difference keeps well within it
      real(wp) :: tolerance = 0.0_wp
      logical :: agrees = .false.
      !> The motion goes on under harmonic loads beyond the horizon
      logical :: goes_on = .false.
      !> Sums evaluated in trials, and these times the modes of each
      integer(i8) :: evaluations = 0_i8
      real(wp) :: work = 0.0_wp
   end type mode_check_t

   !> The mesh of a run, and what a finer one told.
   type :: mesh_check_t
      integer :: elements = 0
      !> Length of an element over that of the next towards the tip
      real(wp) :: ratio = 1.0_wp
      !> The inertia of the stop's node belongs to its neighbours
      logical :: is_redistributed = .false.
      !> They do not, but would better
      logical :: adds_mass = .false.
      !> Elements of the finer mesh; 0: the mesh was given, none was compared
      integer :: compared = 0
      !> Asked for
      real(wp) :: tolerance = 0.0_wp
      !> Up to here both were compared, tau, and their greatest difference in eta of stop and tip or in tau of first
      !> impact or quiet
      real(wp) :: horizon = 0.0_wp
      real(wp) :: difference = 0.0_wp
      !> They agree within the tolerance
      logical :: is_settled = .false.
   end type mesh_check_t

   !> A history; unallocated: not asked for.
   type :: series_t
      real(wp), allocatable :: values(:)
   end type series_t

   !> What happens at one surface, where there are several.
   type :: contact_record_t
      !> Which &stop it belongs to; 1 below the beam, -1 above
      integer :: stop = 1
      integer :: sign = 1
      !> Lc/L, and d in units of displacement
      real(wp) :: position = 1.0_wp
      real(wp) :: height = 0.0_wp
      !> eta of the stop point, y - d there, its velocity, and Pbar, >= 0, at the sample times; unallocated: not asked
      !> for
      real(wp), allocatable :: eta(:)
      real(wp), allocatable :: velocity(:)
      real(wp), allocatable :: force(:)
      !> Its part of the ledger
      real(wp), allocatable :: energy(:)
      real(wp), allocatable :: dissipated(:)
      !> Its measures; those of the whole run (rebounds, quiet, energies) are not meant
      type(run_measures_t), allocatable :: measures
   end type contact_record_t

   !> Bending moment and stress at a place of the beam. Moments in the unit of Pbar times L, positive where the beam is
   !> bent upwards; stresses in E D/L.
   type :: moment_record_t
      !> x/L
      real(wp) :: position = 0.0_wp
      !> Stress at the outer fibre below the axis per moment, and is it known?
      real(wp) :: stress_ratio = 0.0_wp
      logical :: has_stress = .false.
      !> At the sample times; unallocated: not asked for
      real(wp), allocatable :: moment(:)
      !> Least and greatest moment, and when; nothing was measured before the first
      real(wp) :: least = huge(1.0_wp)
      real(wp) :: least_tau = 0.0_wp
      real(wp) :: greatest = -huge(1.0_wp)
      real(wp) :: greatest_tau = 0.0_wp
      !> What the searches for either have left
      type(extreme_search_t) :: minimum_search
      type(extreme_search_t) :: maximum_search
   end type moment_record_t

   type :: response_t
      !> Events in order; only the first `event_count` are meant
      type(event_t), allocatable :: events(:)
      integer :: event_count = 0
      !> Sample times
      real(wp), allocatable :: tau(:)
      !> Those of `history_table` at the sample times
      type(series_t) :: history(history_count)
      !> Surfaces in the scene's order, below before above; unallocated: there is one
      type(contact_record_t), allocatable :: contacts(:)
      !> Moments at the places asked for, in the scene's order; unallocated: nowhere
      type(moment_record_t), allocatable :: moments(:)
      !> Ledger; unallocated: not asked for
      type(energy_t), allocatable :: energy
      !> Measures; unallocated: not asked for
      type(run_measures_t), allocatable :: measures
      !> Statistics; unallocated: not asked for
      type(run_statistics_t), allocatable :: statistics
      !> Sections; unallocated: not asked for
      type(run_sections_t), allocatable :: sections
      !> Surfaces, in the scene's order, that were closed as the run took over a motion; unallocated: it took over none
      logical, allocatable :: starts_closed(:)
      !> Shapes of the whole beam: instants, then eta, its slope d eta/d(x/L), and the rates of both, [node, instant],
      !> clamp first
      real(wp), allocatable :: shape_tau(:)
      real(wp), allocatable :: shape_displacement(:, :)
      real(wp), allocatable :: shape_slope(:, :)
      real(wp), allocatable :: shape_velocity(:, :)
      real(wp), allocatable :: shape_slope_velocity(:, :)
      !> Energy at the start
      real(wp) :: initial_energy = 0.0_wp
      !> In contact at the end of the run
      logical :: ends_in_contact = .false.
      !> Work done: steps taken (newmark) or modal sums evaluated (exact), steps taken back,
      !> factorisations or eigen-solves
      integer(i8) :: evaluations = 0_i8
      integer(i8) :: rejected = 0_i8
      integer :: factorisations = 0
      !> Modes kept (exact)
      type(mode_check_t) :: mode_check
      type(mesh_check_t) :: mesh_check
   end type response_t

contains

   !> Add an event; the array grows by doubling.
   pure subroutine append_event(response, event)
      !> What the event is added to
      type(response_t), intent(inout) :: response
      type(event_t), intent(in) :: event

      type(event_t), allocatable :: larger(:)

      if (.not. allocated(response%events)) allocate (response%events(64))
      if (response%event_count == size(response%events)) then
         allocate (larger(2*size(response%events)))
         larger(:response%event_count) = response%events
         call move_alloc(larger, response%events)
      end if
      response%event_count = response%event_count + 1
      response%events(response%event_count) = event
   end subroutine append_event

   !> How far the ledger of a run is from closing at any of its samples.
   pure function miss_of_energies(response) result(miss)
      !> With energies
      type(response_t), intent(in) :: response
      real(wp) :: miss

      real(wp) :: excess(size(response%energy%kinetic))

      associate (e => response%energy)
         excess = e%kinetic + e%strain + e%stop + e%dissipated_beam + e%dissipated_stop + e%dissipated_impact &
            - e%created - response%initial_energy
         if (allocated(e%work)) excess = excess - e%work
      end associate
      miss = maxval(abs(excess))
   end function miss_of_energies

   !> Does contact that lasts begin here?
   elemental function is_contact_start(kind) result(starts)
      !> One of the `event_` constants
      integer, intent(in) :: kind
      logical :: starts

      starts = kind == event_capture .or. kind == event_contact
   end function is_contact_start

   !> Does contact that lasted end here?
   elemental function is_contact_end(kind) result(ends)
      !> One of the `event_` constants
      integer, intent(in) :: kind
      logical :: ends

      ends = kind == event_release .or. kind == event_separation
   end function is_contact_end

end module response_types
