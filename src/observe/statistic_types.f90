!> What &statistics asks of a run: sums over blocks of it while it goes on, and what they tell at its end
!> (docs/theory.md, section 20).
module statistic_types
   use kinds, only: wp
   use measure_list, only: first_statistic, measure_count
   use signal_peaks, only: extreme_search_t, peak_tolerance
   implicit none (type, external)
   private
   public :: run_statistics_t, block_sums_t, impact_t, contact_sums_t, statistic_count
   public :: sum_time, sum_contact, sum_force, sum_square_force, sum_impulse, sum_impacts, sum_velocity, &
      sum_impact_impulse, sum_displacement, sum_square_displacement, sum_tip, sum_square_tip, top_force, top_velocity, &
      top_impulse, low_displacement, top_displacement, low_tip, top_tip, sum_count

   integer, parameter :: statistic_count = measure_count - first_statistic + 1

   !> Rows of the sums of a surface: integrals, numbers and their sums, extremes
   integer, parameter :: sum_time = 1
   integer, parameter :: sum_contact = 2
   integer, parameter :: sum_force = 3
   integer, parameter :: sum_square_force = 4
   !> Of the force, and impulses
   integer, parameter :: sum_impulse = 5
   integer, parameter :: sum_impacts = 6
   integer, parameter :: sum_velocity = 7
   integer, parameter :: sum_impact_impulse = 8
   integer, parameter :: sum_displacement = 9
   integer, parameter :: sum_square_displacement = 10
   integer, parameter :: sum_tip = 11
   integer, parameter :: sum_square_tip = 12
   integer, parameter :: top_force = 13
   integer, parameter :: top_velocity = 14
   integer, parameter :: top_impulse = 15
   integer, parameter :: low_displacement = 16
   integer, parameter :: top_displacement = 17
   integer, parameter :: low_tip = 18
   integer, parameter :: top_tip = 19
   integer, parameter :: sum_count = 19

   !> An impact: a meeting, and those that follow too soon, or after too low a flight, to be impacts of their own.
   type :: impact_t
      !> Its beginning and end, tau
      real(wp) :: tau = 0.0_wp
      real(wp) :: until = 0.0_wp
      !> Towards the surface as it begins
      real(wp) :: velocity = 0.0_wp
      !> Of forces and impulses within what counts of the run
      real(wp) :: impulse = 0.0_wp
      !> Greatest force
      real(wp) :: force = 0.0_wp
      !> It begins within what counts, with a velocity
      logical :: counts = .false.
   end type impact_t

   !> What gathers of one surface.
   type :: contact_sums_t
      !> Its force has a square
      logical :: yields = .false.
      !> [sum_count, blocks]
      real(wp), allocatable :: sums(:, :)
      !> In order; only the first `count` are meant
      type(impact_t), allocatable :: impacts(:)
      integer :: count = 0
      !> Since the last contact, or the start, the beam has risen above the hop tolerance
      logical :: has_flown = .false.
   end type contact_sums_t

   !> What gathers of a run.
   type :: block_sums_t
      !> Blocks between these instants, tau, [0:blocks]
      real(wp), allocatable :: edge(:)
      !> Length of a pause that ends an impact, tau
      real(wp) :: rest = 0.0_wp
      !> Height below which a flight ends none
      real(wp) :: hop_tolerance = 0.0_wp
      !> Force below which a meeting is no impact, and Pbar per unit of force
      real(wp) :: threshold = 0.0_wp
      real(wp) :: force_scale = 1.0_wp
      integer :: classes = 1
      !> In the scene's order; and of the tip where there is none
      type(contact_sums_t), allocatable :: contact(:)
      type(contact_sums_t) :: tip
      !> Place of the surface to whose stop displacements of the run belong; 0: there is none
      integer :: release_contact = 0
      !> Events that have been looked at
      integer :: seen = 0
      !> What searches for extremes have left, those of all surfaces together
      type(extreme_search_t) :: looks(sum_count)
   end type block_sums_t

   !> What it told.
   type :: run_statistics_t
      !> Beginning and end of the blocks, tau, [0:blocks]
      real(wp), allocatable :: edge(:)
      !> Statistics of all surfaces together, 0, and of each; half the widths of their 95 % intervals; and the same
      !> block by block; NaN: there is none. [statistic_count, 0:surfaces], [statistic_count, blocks, 0:surfaces]
      real(wp), allocatable :: value(:, :), half_width(:, :), in_block(:, :, :)
      !> Impacts in classes of equal width of their greatest force, of a rigid surface of their impulse: upper edges and
      !> numbers, [classes, surfaces]
      real(wp), allocatable :: class_edge(:, :)
      integer, allocatable :: class_count(:, :)
      !> Extremes may be short by so much, as a share, [statistic_count]
      real(wp) :: tolerance(statistic_count) = peak_tolerance
      !> Those of the force, [surfaces]
      logical, allocatable :: yields(:)
   end type run_statistics_t

end module statistic_types
