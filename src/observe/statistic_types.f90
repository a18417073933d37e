!> Types of the statistics of a run: integrals over time, sums over impacts and extremes, all called sums here and
!> accumulated in equal blocks of time, and the statistics that follow from them at the end of the run. The scatter of
!> the blocks gives confidence intervals (docs/theory.md, section 20).
module statistic_types
   use kinds, only: wp
   use measure_list, only: first_statistic, measure_count
   use signal_peaks, only: extreme_search_t, peak_tolerance
   implicit none (type, external)
   private
   public :: run_statistics_t, block_sums_t, impact_t, contact_sums_t, statistic_count
   public :: sum_time, sum_contact, sum_force, sum_square_force, sum_impulse, sum_impacts, sum_velocity, &
      sum_impact_impulse, sum_displacement, sum_square_displacement, sum_tip, sum_square_tip, maximum_force, &
      maximum_velocity, maximum_impulse, minimum_displacement, maximum_displacement, minimum_tip, maximum_tip, &
      sum_count, minimum_force, sum_work, sum_square_acceleration, sum_square_tip_acceleration, minimum_acceleration, &
      maximum_acceleration, minimum_tip_acceleration, maximum_tip_acceleration

   !> Number of statistics of a run; they are the last entries of the list of measures
   integer, parameter :: statistic_count = measure_count - first_statistic + 1

   ! The following constants are the indices of the sums of a contact (integrals, counts and extremes).

   !> Length of the block
   integer, parameter :: sum_time = 1
   !> Time in contact
   integer, parameter :: sum_contact = 2
   !> Integral of the force over time
   integer, parameter :: sum_force = 3
   !> Integral of the square of the force over time
   integer, parameter :: sum_square_force = 4
   !> Integral of the force over time plus all impulses, also of captures and on closed contacts
   integer, parameter :: sum_impulse = 5
   !> Number of impacts
   integer, parameter :: sum_impacts = 6
   !> Sum of the velocities of impacts
   integer, parameter :: sum_velocity = 7
   !> Sum of the impulses of the impacts that count; the integral of the force during each is included
   integer, parameter :: sum_impact_impulse = 8
   !> Integral of the displacement at the contact over time
   integer, parameter :: sum_displacement = 9
   !> Integral of the square of the displacement at the contact over time
   integer, parameter :: sum_square_displacement = 10
   !> Integral of the displacement of the tip over time
   integer, parameter :: sum_tip = 11
   !> Integral of the square of the displacement of the tip over time
   integer, parameter :: sum_square_tip = 12
   !> Minimum of the force, stored among the sums like the other extremes
   integer, parameter :: minimum_force = 13
   !> Maximum of the force
   integer, parameter :: maximum_force = 14
   !> Maximum of the velocities of impacts
   integer, parameter :: maximum_velocity = 15
   !> Maximum of the impulses of impacts
   integer, parameter :: maximum_impulse = 16
   !> Minimum of the displacement at the contact
   integer, parameter :: minimum_displacement = 17
   !> Maximum of the displacement at the contact
   integer, parameter :: maximum_displacement = 18
   !> Minimum of the displacement of the tip
   integer, parameter :: minimum_tip = 19
   !> Maximum of the displacement of the tip
   integer, parameter :: maximum_tip = 20
   !> Energy dissipated at the contact, by dampers and at impacts
   integer, parameter :: sum_work = 21
   !> Integral of the square of the acceleration at the contact over time
   integer, parameter :: sum_square_acceleration = 22
   !> Integral of the square of the acceleration of the tip over time
   integer, parameter :: sum_square_tip_acceleration = 23
   !> Minimum of the acceleration at the contact
   integer, parameter :: minimum_acceleration = 24
   !> Maximum of the acceleration at the contact
   integer, parameter :: maximum_acceleration = 25
   !> Minimum of the acceleration of the tip
   integer, parameter :: minimum_tip_acceleration = 26
   !> Maximum of the acceleration of the tip
   integer, parameter :: maximum_tip_acceleration = 27
   !> Number of sums
   integer, parameter :: sum_count = 27

   !> An impact: a contact, together with further contacts that follow after too short a pause or too low a flight to
   !> count as separate impacts.
   type :: impact_t
      !> Beginning of the impact, tau
      real(wp) :: tau = 0.0_wp
      !> End of the impact, tau, from which the pause to the next impact counts
      real(wp) :: until = 0.0_wp
      !> Velocity towards the stop at the beginning
      real(wp) :: velocity = 0.0_wp
      !> Integral of forces plus impulses, as far as they lie within the blocks
      real(wp) :: impulse = 0.0_wp
      !> Maximum force
      real(wp) :: force = 0.0_wp
      !> Whether the impact counts in the statistics: it begins within the blocks and during the run (not with a contact
      !> that is closed at the start), with a velocity towards the stop; at the end of the run also: its force reaches
      !> `threshold`
      logical :: counts = .false.
   end type impact_t

   !> Sums and impacts of one contact.
   type :: contact_sums_t
      !> Whether the force of the contact is finite (the stop is compliant), so that the integral of the squared force
      !> exists
      logical :: has_finite_force = .false.
      !> Sums, [sum_count, blocks]
      real(wp), allocatable :: sums(:, :)
      !> Impacts in order; only the first `count` are valid
      type(impact_t), allocatable :: impacts(:)
      !> Number of impacts
      integer :: count = 0
      !> Whether the beam has risen above the hop tolerance since the last contact (without one: since the start of the
      !> run)
      logical :: has_separated = .false.
   end type contact_sums_t

   !> Sums of a run.
   type :: block_sums_t
      !> Edges of the blocks, the first and the last included, tau, [0:blocks]
      real(wp), allocatable :: edge(:)
      !> Minimum pause between two impacts, tau (`rest` of &statistics)
      real(wp) :: min_pause = 0.0_wp
      !> Height that a flight must exceed to separate two impacts
      real(wp) :: hop_tolerance = 0.0_wp
      !> Value that the maximum force must reach for an impact to count, if the force is finite
      real(wp) :: threshold = 0.0_wp
      !> Pbar per unit of force
      real(wp) :: force_scale = 1.0_wp
      !> Number of classes of the histograms
      integer :: classes = 1
      !> Whether accelerations are evaluated
      logical :: has_acceleration = .false.
      !> Sums of each contact in the scene's order
      type(contact_sums_t), allocatable :: contact(:)
      !> Sums of the displacement of the tip
      type(contact_sums_t) :: tip
      !> Number of the contact whose displacements are in the statistics of all contacts together (index 0 in
      !> `run_statistics_t`); 0: there is none
      integer :: release_contact = 0
      !> Number of events already processed
      integer :: seen = 0
      !> Tolerances of the searches for extremes, and number of evaluations that remain for them, by the index of the
      !> extreme; the searches at all contacts use them in common
      type(extreme_search_t) :: search_state(sum_count)
   end type block_sums_t

   !> Statistics of a run.
   type :: run_statistics_t
      !> Edges of the blocks, the first and the last included, tau, [0:blocks]
      real(wp), allocatable :: edge(:)
      !> Statistics of all contacts together, index 0, and of each contact, [statistic_count, 0:contacts]; NaN: not
      !> defined
      real(wp), allocatable :: value(:, :)
      !> Half widths of the 95 % confidence intervals of `value`, [statistic_count, 0:contacts]
      real(wp), allocatable :: half_width(:, :)
      !> Statistics as `value`, in each block, [statistic_count, blocks, 0:contacts]
      real(wp), allocatable :: in_block(:, :, :)
      !> Statistics of each stop and body, both sides together, NaN: not defined, [statistic_count, groups in the order
      !> of `measured_groups`]; unallocated: all contacts belong to one stop or body
      real(wp), allocatable :: of_stop(:, :)
      !> Upper edges of the classes, of equal width, of the histogram of the impacts by their maximum force or, at a
      !> rigid contact, by their impulse, [classes, contacts]
      real(wp), allocatable :: class_edge(:, :)
      !> Number of impacts in each class, [classes, contacts]
      integer, allocatable :: class_count(:, :)
      !> Tolerance of extremes, as a fraction of the value, [statistic_count]
      real(wp) :: tolerance(statistic_count) = peak_tolerance
      !> Whether the force of each contact is finite, [contacts]
      logical, allocatable :: has_finite_force(:)
      !> Whether the impact with the maximum impulse of each contact lasts at the end of the blocks, so that its impulse
      !> grows with the length of the blocks, [contacts]
      logical, allocatable :: is_maximum_unfinished(:)
   end type run_statistics_t

end module statistic_types
