!> The analyses of a scene. To add one: its row in `analysis_table`, and its type in `make_analysis`.
module analyses
   use analysis_types, only: analysis_t
   use beam_model, only: beam_model_t
   use failures, only: failure_t
   use frequency_response, only: frequency_response_t
   use kinds, only: wp
   use orbit_analysis, only: orbit_analysis_t
   use quantities, only: units_t
   use quantity_groups, only: quantity_group_t
   use response_types, only: response_t
   use run_settings, only: run_settings_t
   use scene_types, only: scene_t
   implicit none (type, external)
   private
   public :: analysed_t, asks_for, analyse, write_analyses, print_analyses, fill_row, of_beam, of_run

   !> An analysis that is there.
   type :: row_t
      !> Its group, in scenes and in results files
      character(24) :: group = ''
      !> It reads the motion of the run: each case of a sweep has one. Else it is of the beam and its loads alone, and a
      !> sweep has that of the scene itself
      logical :: reads_run = .true.
   end type row_t

   !> In the order of files and of the console.
   type(row_t), parameter :: analysis_table(*) = [ &
      row_t('orbit'), &
      row_t('frequency_response', reads_run=.false.)]

   !> Which analyses are meant, by what they read.
   logical, parameter :: of_beam = .false.
   logical, parameter :: of_run = .true.

   !> An analysis and its group.
   type :: analysed_t
      character(len(analysis_table%group)) :: group = ''
      class(analysis_t), allocatable :: analysis
   end type analysed_t

contains

   !> Make an analysis of a group.
   subroutine make_analysis(group, analysis)
      !> One of the table
      character(*), intent(in) :: group
      class(analysis_t), allocatable, intent(out) :: analysis

      select case (group)
      case ('orbit')
         allocate (orbit_analysis_t :: analysis)
      case ('frequency_response')
         allocate (frequency_response_t :: analysis)
      end select
   end subroutine make_analysis

   !> Which of the table a scene asks for.
   pure function asked(scene, only_those) result(is_asked)
      type(scene_t), intent(in) :: scene
      !> `of_beam` or `of_run`; absent: all
      logical, intent(in), optional :: only_those
      logical :: is_asked(size(analysis_table))

      is_asked = scene%has_group(analysis_table%group)
      if (present(only_those)) is_asked = is_asked .and. (analysis_table%reads_run .eqv. only_those)
   end function asked

   !> Does a scene ask for any?
   pure function asks_for(scene, those) result(answer)
      type(scene_t), intent(in) :: scene
      !> `of_beam` or `of_run`
      logical, intent(in) :: those
      logical :: answer

      answer = any(asked(scene, those))
   end function asks_for

   !> Do the analyses that a scene asks for.
   subroutine analyse(scene, model, settings, response, analysed, error, only_those)
      type(scene_t), intent(in) :: scene
      !> The beam, and its run
      type(beam_model_t), intent(in) :: model
      type(run_settings_t), intent(in) :: settings
      !> Of that run; without one nothing is in it
      type(response_t), intent(in) :: response
      type(analysed_t), allocatable, intent(out) :: analysed(:)
      !> Set by the first that fails
      type(failure_t), allocatable, intent(out) :: error
      !> `of_beam` or `of_run`; absent: all
      logical, intent(in), optional :: only_those

      integer, allocatable :: places(:)
      integer :: i

      places = pack([(i, i=1, size(analysis_table))], asked(scene, only_those))
      allocate (analysed(size(places)))
      do i = 1, size(places)
         analysed(i)%group = analysis_table(places(i))%group
         call make_analysis(trim(analysed(i)%group), analysed(i)%analysis)
         call analysed(i)%analysis%compute(scene, model, settings, response, error)
         if (allocated(error)) return
      end do
   end subroutine analyse

   !> A group for each.
   subroutine write_analyses(group, analysed)
      !> In which they are
      type(quantity_group_t), intent(in) :: group
      type(analysed_t), intent(in) :: analysed(:)

      integer :: i

      do i = 1, size(analysed)
         call analysed(i)%analysis%write(group%part(trim(analysed(i)%group)))
      end do
   end subroutine write_analyses

   !> The lines of each on the console.
   subroutine print_analyses(unit, analysed, units)
      integer, intent(in) :: unit
      type(analysed_t), intent(in) :: analysed(:)
      !> What results are in
      type(units_t), intent(in) :: units

      integer :: i

      do i = 1, size(analysed)
         call analysed(i)%analysis%print(unit, units)
      end do
   end subroutine print_analyses

   !> The measures of each.
   subroutine fill_row(analysed, row)
      type(analysed_t), intent(in) :: analysed(:)
      !> Dimensionless, [measure_count]
      real(wp), intent(inout) :: row(:)

      integer :: i

      do i = 1, size(analysed)
         call analysed(i)%analysis%fill(row)
      end do
   end subroutine fill_row

end module analyses
