!> The analyses that a scene (input file) may request. An analysis computes further results from a finished run, or from
!> the beam and its loads alone. To add an analysis, add an entry to `analysis_table` and a case to `make_analysis`.
module analyses
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use analysis_types, only: analysis_t
   use beam_model, only: beam_model_t
   use failures, only: failure_t
   use frequency_response, only: frequency_response_t
   use kinds, only: wp
   use measure_list, only: measure_count
   use orbit_analysis, only: orbit_analysis_t
   use quantities, only: units_t
   use quantity_groups, only: quantity_group_t
   use response_types, only: response_t
   use run_settings, only: run_settings_t
   use scene_types, only: scene_t
   use spectrum_analysis, only: spectrum_analysis_t
   implicit none (type, external)
   private
   public :: analysed_t, requested, analyse, write_analyses, print_analyses, of_beam, of_run

   !> Entry of the table of analyses.
   type :: entry_t
      !> Name of its group in scenes and of its group in results files
      character(24) :: group = ''
      !> True: the analysis needs a run, and a sweep makes the analysis for each case. False: the analysis needs only
      !> the beam and its loads, and a sweep makes the analysis once, for the scene itself
      logical :: reads_run = .true.
   end type entry_t

   !> All analyses, in the order of results files and of the console.
   type(entry_t), parameter :: analysis_table(*) = [ &
      entry_t('orbit'), &
      entry_t('frequency_response', reads_run=.false.), &
      entry_t('spectrum')]

   !> Selection of the analyses whose input is the beam alone, as in `entry_t%reads_run`.
   logical, parameter :: of_beam = .false.
   !> Selection of the analyses whose input is a run.
   logical, parameter :: of_run = .true.

   !> An analysis and the name of its group.
   type :: analysed_t
      character(len(analysis_table%group)) :: group = ''
      class(analysis_t), allocatable :: analysis
   end type analysed_t

contains

   !> Create the analysis that belongs to a group.
   subroutine make_analysis(group, analysis)
      !> Name of a group in the table
      character(*), intent(in) :: group
      class(analysis_t), allocatable, intent(out) :: analysis

      select case (group)
      case ('orbit')
         allocate (orbit_analysis_t :: analysis)
      case ('frequency_response')
         allocate (frequency_response_t :: analysis)
      case ('spectrum')
         allocate (spectrum_analysis_t :: analysis)
      end select
   end subroutine make_analysis

   !> Whether a scene requests each analysis of the table.
   pure function requested(scene, selection) result(is_requested)
      type(scene_t), intent(in) :: scene
      !> `of_beam` or `of_run`; absent: all analyses
      logical, intent(in), optional :: selection
      logical :: is_requested(size(analysis_table))

      is_requested = scene%has_group(analysis_table%group)
      if (present(selection)) is_requested = is_requested .and. (analysis_table%reads_run .eqv. selection)
   end function requested

   !> Make the analyses that a scene requests.
   subroutine analyse(scene, model, settings, response, analysed, error, selection)
      type(scene_t), intent(in) :: scene
      !> The beam of the scene
      type(beam_model_t), intent(in) :: model
      !> Settings of the run of that beam
      type(run_settings_t), intent(in) :: settings
      !> Result of that run; empty if there was none. The measures of the analyses are added to its measures
      type(response_t), intent(inout) :: response
      type(analysed_t), allocatable, intent(out) :: analysed(:)
      !> Set by the first analysis that fails
      type(failure_t), allocatable, intent(out) :: error
      !> `of_beam` or `of_run`; absent: all analyses
      logical, intent(in), optional :: selection

      integer, allocatable :: places(:)
      integer :: i

      places = pack([(i, i=1, size(analysis_table))], requested(scene, selection))
      allocate (analysed(size(places)))
      do i = 1, size(places)
         analysed(i)%group = analysis_table(places(i))%group
         call make_analysis(trim(analysed(i)%group), analysed(i)%analysis)
         call analysed(i)%analysis%compute(scene, model, settings, response, error)
         if (allocated(error)) return
      end do
      if (size(places) == 0 .or. .not. allocated(response%measures)) return
      allocate (response%measures%of_analyses(measure_count), source=ieee_value(1.0_wp, ieee_quiet_nan))
      do i = 1, size(places)
         call analysed(i)%analysis%supply_measures(response%measures%of_analyses)
      end do
   end subroutine analyse

   !> Write a group of the results file for each analysis.
   subroutine write_analyses(group, analysed)
      !> The group that contains these groups
      type(quantity_group_t), intent(in) :: group
      type(analysed_t), intent(in) :: analysed(:)

      integer :: i

      do i = 1, size(analysed)
         call analysed(i)%analysis%write(group%subgroup(trim(analysed(i)%group)))
      end do
   end subroutine write_analyses

   !> Print the lines of each analysis on the console.
   subroutine print_analyses(unit, analysed, units)
      integer, intent(in) :: unit
      type(analysed_t), intent(in) :: analysed(:)
      !> Units of the printed values
      type(units_t), intent(in) :: units

      integer :: i

      do i = 1, size(analysed)
         call analysed(i)%analysis%print(unit, units)
      end do
   end subroutine print_analyses

end module analyses
