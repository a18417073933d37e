!> Tables of the groups and names of scene files that exclude one another (exclusions) or require one another (demands),
!> and the check of a file against these tables.
module scene_rules
   use name_table, only: table_t
   use name_types, only: is_among
   use scene_input, only: scene_input_t
   use scene_requests, only: request_names
   implicit none (type, external)
   private
   public :: check_rules

   !> Maximum length of a name of a group or in a group.
   integer, parameter :: max_name_length = 32
   !> Maximum length of a list of names.
   integer, parameter :: max_list_length = 200
   !> Maximum length of the text of a problem.
   integer, parameter :: max_problem_length = 112

   !> A group, and other groups that it excludes.
   type :: exclusion_t
      !> Name of the group
      character(max_name_length) :: group = ''
      !> Excluded groups, separated by blanks
      character(max_list_length) :: excluded = ''
      !> Text that is appended to 'does not go with &group'
      character(max_problem_length) :: reason = ''
      !> Whether the groups in `request_names` are excluded too
      logical :: excludes_requests = .false.
   end type exclusion_t

   !> A group, or a name of a group, that requires at least one of several others.
   type :: demand_t
      character(max_name_length) :: group = ''
      !> The name that makes the demand; empty: the group makes it
      character(max_name_length) :: name = ''
      !> Groups, or names of the same group, of which one is required; separated by blanks
      character(max_list_length) :: options = ''
      !> Message if the demand is not met
      character(max_problem_length) :: problem = ''
   end type demand_t

   ! exclusions of groups that are studies of their own; they are checked before the demands, because an excluded group
   ! could have unmet demands, which would give misleading messages
   type(exclusion_t), parameter :: studies(*) = [ &
      exclusion_t('statements', &
      'beam section root mass mesh damping tip_mass stop body support force base start response frequencies ' &
      //'precision sweep best cases sensitivity stress output', ', which has beams, stops and runs of its own', &
      excludes_requests=.true.), &
      exclusion_t('precision', 'body support', ', which measures beams on their root and stops alone'), &
      exclusion_t('precision', 'response sweep best cases sensitivity stress output', ', which has runs of its own', &
      excludes_requests=.true.)]

   !> Other exclusions, which are checked after the demands.
   type(exclusion_t), parameter :: exclusions(*) = [ &
      exclusion_t('sweep', 'frequencies cases', '; give it a scene of its own'), &
      exclusion_t('sweep', 'output', &
      ': each case is a row of measures; for histories run a scene of that case alone'), &
      exclusion_t('cases', 'frequencies', '; give it a scene of its own'), &
      exclusion_t('orbit', 'sweep cases sensitivity', '; give it a scene of its own'), &
      exclusion_t('sensitivity', 'frequencies cases sweep best orbit frequency_response', &
      '; give it a scene of its own'), &
      exclusion_t('fit', 'best statistics poincare orbit frequency_response stress', '; give it a scene of its own'), &
      exclusion_t('uncertainty', 'best fit', '; give it a scene of its own'), &
      exclusion_t('sensitivity', 'output', ', which keeps measures alone')]

   ! Messages that several demands have in common
   character(*), parameter :: a_response = 'needs a response; add &response / (with or without names in it)'
   character(*), parameter :: a_sweep = 'needs a sweep; add &sweep with the parameters to vary'

   ! index of the implied loop in `demands`
   integer, private :: k
   ! if two demands of one group are not met, only the first is reported
   type(demand_t), parameter :: demands(*) = [ &
      demand_t('precision', '', 'stop frequencies', &
      'needs &stop / to compare motion, or &frequencies / to compare solvers'), &
      demand_t('precision', 'against_beam', 'mesh_elements', 'needs mesh_elements too, the meshes to compare'), &
      demand_t('response', '', 'stop body force base start', &
      'needs a stop; add &stop / (with or without names in it), or &body, &force, &base or &start'), &
      demand_t('body', '', 'response', a_response), &
      demand_t('force', '', 'response precision', a_response), &
      demand_t('base', '', 'response precision', a_response), &
      demand_t('start', '', 'response precision', a_response), &
      demand_t('stress', '', 'response', a_response), &
      demand_t('relay', '', 'stop body', 'needs a stop, the contact that closes; add &stop / or &body'), &
      (demand_t(request_names(k), '', 'response', a_response), k=1, size(request_names)), &
      demand_t('sweep', '', 'response', a_response), &
      demand_t('sensitivity', '', 'response', a_response), &
      demand_t('uncertainty', '', 'sweep', 'needs the ranges of what is uncertain; add &sweep'), &
      demand_t('fit', '', 'sweep', 'needs the ranges of what is fitted; add &sweep'), &
      demand_t('cases', '', 'response', a_response), &
      demand_t('best', '', 'sweep response', a_sweep//', and &response /'), &
      demand_t('best', '', 'sweep cases', a_sweep), &
      demand_t('best', '', 'sweep', 'does not go with &cases; give it a scene with &sweep'), &
      demand_t('output', '', 'response frequencies', &
      'there are no results to store; add &response / or &frequencies /'), &
      demand_t('stress', 'fatigue_threshold_ratio', 'fatigue_slope', 'needs fatigue_slope too'), &
      demand_t('stress', 'fatigue_threshold', 'fatigue_slope', 'needs fatigue_slope too'), &
      demand_t('stress', 'fatigue_classes', 'fatigue_slope', 'needs fatigue_slope too'), &
      demand_t('stress', 'fatigue_limit', 'fatigue_slope', 'needs fatigue_slope too'), &
      demand_t('beam', 'height_tip', 'height_root', 'needs height_root too (or give taper and mean_height_ratio)'), &
      demand_t('beam', 'height', 'station', 'needs station; a beam without a table takes height_root'), &
      demand_t('beam', 'station', 'height area inertia', 'needs height, or area and inertia'), &
      demand_t('beam', 'area', 'inertia', 'needs inertia too'), &
      demand_t('beam', 'inertia', 'area', 'needs area too')]

contains

   !> Check all exclusions and demands. Problems are reported to `input`.
   subroutine check_rules(input, table)
      type(scene_input_t), intent(inout) :: input
      !> Table of names with the values of the file
      type(table_t), intent(in) :: table

      integer :: i

      do i = 1, size(studies)
         call exclude(input, table, studies(i))
      end do
      if (input%has_problem()) return
      do i = 1, size(demands)
         if (.not. is_met(table, demands(i))) then
            call input%complain(trim(demands(i)%group), trim(demands(i)%name), trim(demands(i)%problem))
         end if
      end do
      if (input%has_problem()) return
      do i = 1, size(exclusions)
         call exclude(input, table, exclusions(i))
      end do
   end subroutine check_rules

   !> Report each group of the file that another group of the file excludes. Whether the file has a group is known from
   !> its text (`has_group`), and for a group of the table also from `is_wanted`.
   subroutine exclude(input, table, exclusion)
      type(scene_input_t), intent(inout) :: input
      type(table_t), intent(in) :: table
      type(exclusion_t), intent(in) :: exclusion

      integer :: i

      if (.not. input%has_group(trim(exclusion%group))) return
      do i = 1, table%group_count
         associate (group => table%groups(i))
            if (.not. (group%is_wanted .and. (is_among(group%name, exclusion%excluded) .or. &
               exclusion%excludes_requests .and. any(group%name == request_names)))) cycle
            call input%complain(trim(group%name), '', &
               'does not go with &'//trim(exclusion%group)//trim(exclusion%reason))
         end associate
      end do
   end subroutine exclude

   !> Whether a demand is met, or the file has not the group or name that makes the demand.
   pure logical function is_met(table, demand)
      type(table_t), intent(in) :: table
      type(demand_t), intent(in) :: demand

      integer :: group, i, place

      group = table%find_group(demand%group)
      if (demand%name == '') then
         is_met = .not. table%groups(group)%is_wanted
      else
         ! a sweep gives a name without a group of the file; of some groups without that the table has no names
         place = table%find(group, demand%name)
         is_met = place == 0
         if (place > 0) is_met = .not. table%entries(place)%is_given
      end if
      if (is_met) return
      if (demand%name == '') then
         do i = 1, table%group_count
            is_met = is_met .or. (table%groups(i)%is_wanted .and. is_among(table%groups(i)%name, demand%options))
         end do
      else
         do i = table%groups(group)%first_entry, table%groups(group)%last_entry
            is_met = is_met .or. (table%entries(i)%is_given .and. is_among(table%entries(i)%name%name, demand%options))
         end do
      end if
   end function is_met

end module scene_rules
